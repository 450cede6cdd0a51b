#include "workers/curve_keys.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <map>
#include <set>
#include <sstream>
#include <zmq.hpp>

#include "sim/distributed_world.h"
#include "sim/errors.h"

namespace sim {
namespace {

namespace fs = std::filesystem;
constexpr std::size_t kKeyLength = 40;

[[noreturn]] void refuse(const std::string& found, const std::string& expected) {
    throw InputError("", found, expected);
}

bool is_key(const std::string& text) {
    std::array<std::uint8_t, 32> bytes{};
    return text.size() == kKeyLength && zmq_z85_decode(bytes.data(), text.c_str());
}

void write_new(const fs::path& file, const std::string& text, mode_t mode) {
    const int descriptor = open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, mode);
    bool written = descriptor >= 0;
    for (std::size_t done = 0; written && done < text.size();) {
        const ssize_t wrote = write(descriptor, text.data() + done, text.size() - done);
        written = wrote > 0 || (wrote < 0 && errno == EINTR);
        if (wrote > 0) done += static_cast<std::size_t>(wrote);
    }
    if (descriptor >= 0) written = close(descriptor) == 0 && written;
    if (!written) throw WorkerError("cannot write " + file.string() + ": " + std::strerror(errno));
}

std::vector<std::array<std::string, 2>> read_lines(const fs::path& file) {
    std::ifstream in(file);
    if (!in)
        throw InputError("cannot open key file " + file.string() + ": " + std::strerror(errno) +
                         "; `musicworld keys` makes one");
    std::vector<std::array<std::string, 2>> lines;
    for (std::string line; std::getline(in, line);) {
        std::istringstream words(line);
        std::array<std::string, 2> two;
        if (words >> two[0]) words >> two[1], lines.push_back(two);
    }
    return lines;
}

std::map<std::string, std::string> read_secrets(const fs::path& file,
                                                const std::vector<std::string>& expected) {
    struct stat status {};
    if (stat(file.c_str(), &status) == 0 && (status.st_mode & 077) != 0)
        refuse("secret key " + file.string() + " that others may read", "mode 0600; chmod 600 it");
    std::map<std::string, std::string> keys;
    for (const auto& [word, key] : read_lines(file)) keys[word] = key;
    for (const std::string& word : expected)
        if (!is_key(keys[word]))
            refuse(file.string() + " without the key '" + word + "'", "40 characters of Z85");
    return keys;
}

bool is_name(const std::string& name) {
    const auto fits = [](unsigned char c) { return std::isalnum(c) || c == '-' || c == '_' || c == '.'; };
    return !name.empty() && name.size() < 200 && name[0] != '.' &&
           std::all_of(name.begin(), name.end(), fits);
}

void check_names(const std::vector<std::string>& names) {
    std::set<std::string> seen = {"application"};
    for (const std::string& name : names) {
        if (!is_name(name)) refuse("worker's name '" + name + "'", "letters, digits, '-', '_' and '.'");
        if (!seen.insert(name).second) refuse("worker's name '" + name + "' twice", "names that differ");
    }
}

void write_keys(const fs::path& folder, const std::vector<std::string>& names) {
    const KeyPair application = make_key_pair();
    std::string allowed;
    for (const std::string& name : names) {
        const KeyPair worker = make_key_pair();
        write_new(folder / (name + ".key"),
                  "public " + worker.shown + "\nsecret " + worker.secret + "\napplication " +
                      application.shown + "\n",
                  0600);
        allowed += worker.shown + " " + name + "\n";
    }
    write_new(folder / "allowed", allowed, 0644);
    write_new(folder / "application.pub", application.shown + "\n", 0644);
    write_new(folder / "application.key",
              "public " + application.shown + "\nsecret " + application.secret + "\n", 0600);
}

/// ADDRESS of tcp://ADDRESS:PORT; empty for another endpoint.
std::string address_of(const std::string& endpoint) {
    const std::string rest = endpoint.substr(std::min<std::size_t>(6, endpoint.size()));
    const std::size_t colon = rest.rfind(':');
    if (!endpoint.starts_with("tcp://") || colon == std::string::npos) return {};
    const std::string port = rest.substr(colon + 1);
    const auto digit = [](unsigned char c) { return std::isdigit(c) != 0; };
    const bool number = !port.empty() && port.size() <= 5 && std::all_of(port.begin(), port.end(), digit) &&
                        std::stoi(port) <= 65535;
    return number || port == "*" ? rest.substr(0, colon) : std::string();
}

bool is_loopback(const std::string& address) {
    const auto number = [](unsigned char c) { return std::isdigit(c) != 0 || c == '.'; };
    return address == "localhost" || address == "[::1]" ||
           (address.starts_with("127.") && std::all_of(address.begin(), address.end(), number));
}

}  // namespace

KeyPair make_key_pair() {
    std::array<char, kKeyLength + 1> shown{}, secret{};
    if (zmq_curve_keypair(shown.data(), secret.data()) != 0)
        throw WorkerError("cannot make CURVE keys: this ZeroMQ is built without libsodium");
    return {shown.data(), secret.data()};
}

ApplicationKeys read_application_keys(const fs::path& folder) {
    auto keys = read_secrets(folder / "application.key", {"public", "secret"});
    ApplicationKeys application{{keys["public"], keys["secret"]}, {}};
    for (const auto& [key, name] : read_lines(folder / "allowed")) {
        if (!is_key(key))
            refuse((folder / "allowed").string() + " with '" + key + "'", "a public key a line");
        application.allowed.push_back(key);
    }
    return application;
}

WorkerKeys read_worker_keys(const fs::path& file) {
    auto keys = read_secrets(file, {"public", "secret", "application"});
    return {{keys["public"], keys["secret"]}, keys["application"]};
}

void check_endpoint(const std::string& endpoint, bool keys) {
    if (endpoint.starts_with("ipc://") && endpoint.size() > 6) return;
    const std::string address = address_of(endpoint);
    if (address.empty()) refuse("endpoint " + endpoint, "tcp://ADDRESS:PORT or ipc://PATH");
    if (!keys && !is_loopback(address))
        refuse("endpoint " + endpoint + " without keys",
               "keys wherever it can be reached from other machines; make them with `musicworld keys`");
}

void make_keys(const fs::path& folder, const std::vector<std::string>& workers) {
    check_names(workers);
    if (mkdir(folder.c_str(), 0700) != 0) {
        if (errno == EEXIST)
            refuse(folder.string() + ", which is there already", "a new folder; nothing is overwritten");
        throw InputError("cannot make the folder " + folder.string() + ": " + std::strerror(errno));
    }
    try {
        write_keys(folder, workers);
    } catch (...) {
        std::error_code ignored;
        fs::remove_all(folder, ignored);
        throw;
    }
}

}  // namespace sim
