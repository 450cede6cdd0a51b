#include "workers/curve_keys.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "key_folder.h"
#include "sim/distributed_world.h"

namespace {

namespace fs = std::filesystem;
using sim_test::KeyFolder;

std::string text_of(const fs::path& file) {
    std::ostringstream text;
    text << std::ifstream(file).rdbuf();
    return text.str();
}

TEST(CurveKeys, AFolderHoldsSecretsThatOnlyTheOwnerReadsAndKeysThatFitEachOther) {
    const KeyFolder keys({"left", "right"});
    EXPECT_EQ(fs::status(keys.path()).permissions(), fs::perms::owner_all);
    for (const char* name : {"application.key", "left.key", "right.key"})
        EXPECT_EQ(fs::status(keys.path() / name).permissions(),
                  fs::perms::owner_read | fs::perms::owner_write)
            << name;
    const sim::ApplicationKeys application = sim::read_application_keys(keys.path());
    const sim::WorkerKeys left = sim::read_worker_keys(keys.path() / "left.key");
    const sim::WorkerKeys right = sim::read_worker_keys(keys.path() / "right.key");
    EXPECT_EQ(application.allowed, (std::vector<std::string>{left.pair.shown, right.pair.shown}));
    EXPECT_EQ(left.application, application.pair.shown);
    EXPECT_EQ(text_of(keys.path() / "application.pub"), application.pair.shown + "\n");
    EXPECT_NE(left.pair.secret, right.pair.secret);
    EXPECT_EQ(text_of(keys.path() / "left.key").find(application.pair.secret), std::string::npos);
}

TEST(CurveKeys, AFolderThatIsThereAndNamesThatCannotBeFilesAreRefusedAndNothingIsWritten) {
    const KeyFolder keys({"worker"});
    const std::string before = text_of(keys.path() / "application.key");
    EXPECT_THROW(sim::make_keys(keys.path(), {"worker"}), std::invalid_argument);
    EXPECT_EQ(text_of(keys.path() / "application.key"), before);
    const fs::path fresh = keys.path() / "fresh";
    for (const char* name : {"", "../up", "a/b", "application", ".hidden", "a b"})
        EXPECT_THROW(sim::make_keys(fresh, {name}), std::invalid_argument) << name;
    EXPECT_THROW(sim::make_keys(fresh, {"twice", "twice"}), std::invalid_argument);
    EXPECT_FALSE(fs::exists(fresh));
}

TEST(CurveKeys, SecretsThatOthersMayReadAndKeysThatAreNoneAreRefused) {
    const KeyFolder keys({"worker"});
    const fs::path worker = keys.path() / "worker.key";
    fs::permissions(worker, fs::perms::group_read, fs::perm_options::add);
    EXPECT_THROW((void)sim::read_worker_keys(worker), std::invalid_argument);
    fs::permissions(worker, fs::perms::group_read, fs::perm_options::remove);
    EXPECT_NO_THROW((void)sim::read_worker_keys(worker));
    std::ofstream(worker) << "public short\nsecret short\napplication short\n";
    EXPECT_THROW((void)sim::read_worker_keys(worker), std::invalid_argument);
    EXPECT_THROW((void)sim::read_worker_keys(keys.path() / "none.key"), std::invalid_argument);
    std::ofstream(keys.path() / "allowed") << "not-a-key worker\n";
    EXPECT_THROW((void)sim::read_application_keys(keys.path()), std::invalid_argument);
}

TEST(CurveKeys, EndpointsThatOtherMachinesReachNeedKeys) {
    for (const char* near :
         {"ipc:///tmp/x", "tcp://127.0.0.1:0", "tcp://127.0.0.1:*", "tcp://localhost:5555", "tcp://[::1]:80"})
        EXPECT_NO_THROW(sim::check_endpoint(near, false)) << near;
    for (const char* far : {"tcp://*:5555", "tcp://0.0.0.0:5555", "tcp://10.0.0.1:5555",
                            "tcp://127.evil.example:5555", "tcp://eth0:5555"}) {
        EXPECT_THROW(sim::check_endpoint(far, false), std::invalid_argument) << far;
        EXPECT_NO_THROW(sim::check_endpoint(far, true)) << far;
    }
    for (const char* none : {"", "tcp://", "tcp://10.0.0.1", "tcp://10.0.0.1:", "tcp://10.0.0.1:70000",
                             "udp://10.0.0.1:1", "ipc://", "tcp://10.0.0.1:12x", "inproc://x"})
        EXPECT_THROW(sim::check_endpoint(none, true), std::invalid_argument) << none;
}

}  // namespace
