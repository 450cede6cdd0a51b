// The example files in assets/launchers, as far as a machine without those launchers shows: the scripts are
// run with stand-ins for ssh and srun that run here what they are given, the Jobs' commands are run as pods
// would, and systemd looks at its unit.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "program.h"

namespace end_to_end {
namespace {

namespace fs = std::filesystem;
using nlohmann::json;

const std::string kScene =
    "[[body]]\nname = \"b\"\nradius = 0.5\nfidelity = \"rigid\"\nposition = [0, 1, 0]\n"
    "grid = { count = [2, 2, 2], step = [1.2, 1.2, 1.2] }\n[[plane]]\n";

const std::string kProgramPath = std::string("MUSICWORLD=") + MUSICWORLD_PROGRAM;

std::string launcher(const std::string& name) {
    return bundled("launchers/" + name).string();
}

/// A port for this process; the range is below those that the system hands out.
std::string port() {
    return std::to_string(20000 + getpid() % 10000);
}

void write_program(const fs::path& file, const std::string& text) {
    write(file, "#!/bin/sh\n" + text);
    fs::permissions(file, fs::perms::owner_all);
}

std::string replaced(std::string text, const std::string& from, const std::string& to) {
    for (std::size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
        text.replace(at, from.size(), to);
    return text;
}

void expect_two_workers(const Ended& ended, const fs::path& out) {
    ASSERT_EQ(ended.status, 0) << ended.err << ended.out;
    const json summary = json::parse(read(out / "summary.json"));
    EXPECT_EQ(summary["workers"], 2);
    EXPECT_EQ(summary["bodies_lost"], 0);
    EXPECT_EQ(summary["bodies"], 8);
    std::set<std::string> workers;
    for (const auto& row : read_csv(out / "timing.csv")) workers.insert(row.at("worker"));
    EXPECT_EQ(workers, (std::set<std::string>{"0", "1"}));
}

TEST(Launchers, TheSshScriptRunsASceneWithAWorkerAHost) {
    const Folder folder;
    write(folder / "scene.toml", kScene);
    // A host is a folder that is the remote shell's home; the options before it are dropped.
    write_program(folder / "ssh", "while [ \"$1\" = -o ]; do shift 2; done\nshift\nexec sh -c \"$*\"\n");
    const Ended ended =
        run_command({"bash", launcher("ssh.sh"), folder / "scene.toml", folder / "out", "first", "second"},
                    {"PATH=" + (folder / "").string() + ":/usr/bin:/bin", kProgramPath, "ADDRESS=127.0.0.1",
                     "PORT=" + port()});
    expect_two_workers(ended, folder / "out");
}

TEST(Launchers, TheSlurmScriptRunsASceneWithAWorkerATask) {
    const Folder folder;
    write(folder / "scene.toml", kScene);
    write_program(folder / "srun",
                  "while [ \"${1#--}\" != \"$1\" ]; do shift; done\n"
                  "for task in $(seq $SLURM_NTASKS); do \"$@\" & done\nwait\n");
    const Ended ended = run_command(
        {"bash", launcher("slurm.sh"), folder / "scene.toml", folder / "out"},
        {"PATH=" + (folder / "").string() + ":/usr/bin:/bin", kProgramPath,
         "SLURM_JOB_ID=" + std::to_string(getpid()), "SLURM_NTASKS=2", "SLURMD_NODENAME=127.0.0.1"});
    expect_two_workers(ended, folder / "out");
    EXPECT_FALSE(fs::exists(folder / ("out/keys-" + std::to_string(getpid()))));  // keys go with the job
}

/// The documents of a YAML file.
json yaml(const std::string& file) {
    const Ended ended = run_command(
        {"/usr/bin/python3", "-c",
         "import json, sys, yaml; print(json.dumps(list(yaml.safe_load_all(open(sys.argv[1])))))", file});
    EXPECT_EQ(ended.status, 0) << ended.err;
    return ended.status == 0 ? json::parse(ended.out) : json();
}

TEST(Launchers, TheKubernetesServiceFindsTheApplicationAndVolumesAreThere) {
    const json documents = yaml(launcher("kubernetes.yaml"));
    ASSERT_EQ(documents.size(), 3u);
    const json &service = documents[0], &application = documents[1];
    EXPECT_EQ(service["kind"], "Service");
    EXPECT_EQ(service["spec"]["selector"], application["spec"]["template"]["metadata"]["labels"]);
    for (const json& job : {documents[1], documents[2]}) {
        EXPECT_EQ(job["apiVersion"], "batch/v1");
        EXPECT_EQ(job["kind"], "Job");
        const json& pod = job["spec"]["template"]["spec"];
        EXPECT_TRUE(pod["restartPolicy"] == "Never" || pod["restartPolicy"] == "OnFailure");  // of Jobs
        std::set<std::string> volumes;
        for (const json& volume : pod["volumes"]) volumes.insert(volume["name"]);
        for (const json& mount : pod["containers"][0]["volumeMounts"])
            EXPECT_TRUE(volumes.contains(mount["name"])) << mount;
    }
    EXPECT_EQ(documents[2]["spec"]["completions"], documents[2]["spec"]["parallelism"]);
}

TEST(Launchers, TheKubernetesJobsCommandsRunASceneTogether) {
    const Folder folder;
    write(folder / "scene.toml", kScene);
    ASSERT_EQ(run({"keys", folder / "keys", "--workers", "worker-0,worker-1"}).status, 0);
    const json documents = yaml(launcher("kubernetes.yaml"));
    const auto here = [&](const json& word) {
        std::string text = replaced(word, "tcp://musicworld:5860", "tcp://127.0.0.1:" + port());
        text = replaced(text, "tcp://0.0.0.0:5860", "tcp://0.0.0.0:" + port());
        text = replaced(text, "/keys", (folder / "keys").string());
        text = replaced(text, "/out", (folder / "out").string());
        text = replaced(text, "benchmark400", (folder / "scene.toml").string());
        text = text == "4" ? "2" : text;
        return "'" + replaced(text, "musicworld ", MUSICWORLD_PROGRAM " ") + "' ";
    };
    const auto command = [&](const json& job) {
        std::string words;
        for (const json& word : job["spec"]["template"]["spec"]["containers"][0]["command"])
            words += word == "musicworld" ? "'" MUSICWORLD_PROGRAM "' " : here(word);
        return words;
    };
    std::string script;
    for (const char* index : {"0", "1"})
        script += "JOB_COMPLETION_INDEX=" + std::string(index) + " " + command(documents[2]) + "& ";
    const Ended ended = run_command({"bash", "-c", script + command(documents[1]) + "&& wait"});
    expect_two_workers(ended, folder / "out");
}

TEST(Launchers, SystemdAcceptsTheUnitAndItsCommandLineIsOurs) {
    if (run_command({"sh", "-c", "command -v systemd-analyze"}).status != 0)
        GTEST_SKIP() << "no systemd-analyze here";
    const Folder folder;
    const std::string unit = replaced(read(launcher("musicworld-worker@.service")),
                                      "/usr/local/bin/musicworld", MUSICWORLD_PROGRAM);
    write(folder / "musicworld-worker@1.service", unit);
    const Ended good =
        run_command({"systemd-analyze", "verify", "--man=no", folder / "musicworld-worker@1.service"});
    EXPECT_EQ(good.status, 0) << good.err;
    EXPECT_EQ(good.err.find("musicworld-worker"), std::string::npos) << good.err;
    // That it would say so: an unknown key is named.
    write(folder / "musicworld-worker@1.service", replaced(unit, "Restart=", "Restrat="));
    const Ended wrong =
        run_command({"systemd-analyze", "verify", "--man=no", folder / "musicworld-worker@1.service"});
    EXPECT_NE(wrong.err.find("Restrat"), std::string::npos) << wrong.err;

    const std::size_t at = unit.find("ExecStart=") + 10;
    const std::string line =
        replaced(replaced(unit.substr(at, unit.find('\n', at) - at), "${ENDPOINT}", "nonsense"),
                 "${CREDENTIALS_DIRECTORY}", folder / "");
    const Ended ended = run_command({"sh", "-c", line});
    expect_refused(ended, "worker.key");  // the endpoint or the key, not the options
    for (const char* usage : {"--help", "an option of"})
        EXPECT_EQ(ended.err.find(usage), std::string::npos) << ended.err;
}

}  // namespace
}  // namespace end_to_end
