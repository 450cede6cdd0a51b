#pragma once
#include <filesystem>
#include <string>
#include <vector>

namespace sim {

// CURVE keys in ZeroMQ's form: Z85, 40 characters. Each line of a file is a word and a key:
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

/// Both throw std::invalid_argument, which says what was found and what was expected. A secret that others
/// may read is refused.
[[nodiscard]] ApplicationKeys read_application_keys(const std::filesystem::path& folder);
[[nodiscard]] WorkerKeys read_worker_keys(const std::filesystem::path& file);

/// Throws std::invalid_argument unless the endpoint is ipc://PATH or tcp://ADDRESS:PORT. Without keys the
/// address must be of this machine alone. `*` is every address.
void check_endpoint(const std::string& endpoint, bool keys);

}  // namespace sim
