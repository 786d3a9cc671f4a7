#include "reach/daemon_options.h"

#include <CLI/CLI.hpp>
#include <cstdlib>

#include "files/default_socket.h"
#include "files/text_file.h"
#include "options/number_checks.h"

namespace mbcosim::server {
namespace {

/// Editors end the line of a token.
std::string token_of_file(const std::string& path) {
  std::string text = text_of_file(path);
  while (!text.empty() && (text.back() == '\n' || text.back() == '\r')) text.pop_back();
  if (text.empty()) throw std::runtime_error("there is no token in \"" + path + "\"");
  return text;
}

std::string from_environment(const char* name, const std::string& otherwise) {
  const char* const value = std::getenv(name);
  return value && *value ? value : otherwise;
}

/// What is given goes before the environment, there the token itself before a file.
std::string token_of(const DaemonOptions& options) {
  if (!options.token_file.empty()) return token_of_file(options.token_file);
  if (!options.token.empty()) return options.token;
  const std::string path = from_environment("MBCOSIM_TOKEN_FILE", "");
  return path.empty() ? "" : token_of_file(path);
}

}  // namespace

void add_daemon_options(CLI::App& command, DaemonOptions& options) {
  // Not CLI11's `envname`: commands that share these options would each set them, one after the
  // other's command line.
  options.address = from_environment("MBCOSIM_ADDRESS", default_socket());
  options.token = from_environment("MBCOSIM_TOKEN", "");
  options.tls = from_environment("MBCOSIM_TLS", "0") != "0";
  options.ca = from_environment("MBCOSIM_TLS_CA", "");
  options.certificate = from_environment("MBCOSIM_TLS_CERTIFICATE", "");
  options.key = from_environment("MBCOSIM_TLS_KEY", "");
  command
      .add_option("--address", options.address,
                  "The daemon's: unix:PATH or HOST:PORT; the default is MBCOSIM_ADDRESS of the "
                  "environment, where that is set")
      ->capture_default_str();
  command.add_option("--token", options.token,
                     "Bearer token; default: MBCOSIM_TOKEN of the environment, or what the file "
                     "MBCOSIM_TOKEN_FILE holds");
  command.add_option("--token-file", options.token_file,
                     "File with the bearer token; goes before the token itself");
  command.add_flag(
      "--tls", options.tls,
      "The connection uses TLS, as with one of the next; default: where MBCOSIM_TLS of "
      "the environment is 1");
  command.add_option("--ca", options.ca,
                     "PEM file: authority of the daemon's certificate; default: MBCOSIM_TLS_CA of "
                     "the environment, or those that this machine trusts");
  command.add_option("--certificate", options.certificate,
                     "PEM file of this client; default: MBCOSIM_TLS_CERTIFICATE");
  command.add_option("--key", options.key, "PEM file of its key; default: MBCOSIM_TLS_KEY");
  command.add_option("--timeout", options.timeout, "Seconds to wait for the daemon")
      ->capture_default_str()
      ->check(NumberCheck::above(0));
}

client::Server reach(const DaemonOptions& options) {
  check_default_socket(options.address);
  const client::Credentials credentials{.token = token_of(options),
                                        .tls = options.tls,
                                        .server_ca = text_of_file(options.ca),
                                        .certificate = text_of_file(options.certificate),
                                        .key = text_of_file(options.key)};
  return client::Server::connect(options.address, options.timeout, credentials);
}

}  // namespace mbcosim::server
