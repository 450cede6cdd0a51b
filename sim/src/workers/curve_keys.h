#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace sim {

// CURVE keys, as ZeroMQ takes them: Z85, 40 characters. Files hold lines of a word and a key:
//   application.key  public, secret            0600
//   application.pub  the public key alone
//   NAME.key         public, secret, application (the application's public key)    0600
//   allowed          a worker's public key and its name, a line each

struct KeyPair {
    std::string shown, secret;
};
[[nodiscard]] KeyPair make_key_pair();  ///< throws std::runtime_error

struct ApplicationKeys {
    KeyPair pair;
    std::vector<std::string> allowed;
};
struct WorkerKeys {
    KeyPair pair;
    std::string application;
};

/// Throw std::invalid_argument: what was found, what was expected. A secret that others may read is refused.
[[nodiscard]] ApplicationKeys read_application_keys(const std::filesystem::path& folder);
[[nodiscard]] WorkerKeys read_worker_keys(const std::filesystem::path& file);

/// Throws std::invalid_argument unless it is ipc://PATH or tcp://ADDRESS:PORT, and where it leaves this
/// machine only with keys. `*` is every address.
void check_endpoint(const std::string& endpoint, bool keys);

}  // namespace sim
