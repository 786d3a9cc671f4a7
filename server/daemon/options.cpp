#include "daemon/options.h"

#include <unistd.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <iostream>
#include <sstream>

#include "daemon/environment.h"
#include "files/default_socket.h"
#include "input/suggest.h"
#include "options/address_checks.h"
#include "options/number_checks.h"
#include "rpc/auth.h"

namespace mbcosim::server {
namespace {

constexpr std::int64_t kLongestTime = 1'000'000'000;  ///< [s], some 30 years

void add_limits(CLI::App& app, ServiceLimits& limits, std::int64_t& lease) {
  const auto add_checked = [&](const char* name, auto& value, const char* help,
                               const NumberCheck& check) {
    app.add_option(name, value, help)->group("Limits")->capture_default_str()->check(check);
  };
  const auto add = [&](const char* name, auto& value, const char* help) {
    add_checked(name, value, help, NumberCheck::above(0));
  };
  add("--limit-sessions", limits.sessions, "Simulations alive at once");
  add("--limit-snapshots", limits.snapshots, "Snapshots of one simulation");
  add("--limit-snapshot-bytes", limits.snapshot_bytes, "Memory of all snapshots of one simulation");
  add("--limit-record-bytes", limits.record_bytes,
      "Memory of the record of one simulation's ports");
  add("--limit-bundle-files", limits.bundle_files, "Files of one uploaded deck");
  add("--limit-deck-bytes", limits.engine.deck_bytes, "Bytes of one deck with all its files");
  add("--limit-include-depth", limits.engine.include_depth, "Nested includes");
  add("--limit-include-count", limits.engine.include_count, "Included files of one deck");
  add("--limit-statements", limits.engine.statements, "Statements of one deck, every pass counted");
  add("--limit-loop-iterations", limits.engine.loop_iterations, "Passes of one loop of a deck");
  const NumberCheck in_the_stack = NumberCheck::within(1, 10000);
  add_checked("--limit-expression-depth", limits.engine.expression_depth,
              "Nested parts of an expression", in_the_stack);
  add_checked("--limit-nesting-depth", limits.engine.nesting_depth,
              "Nested `for` and `if`, nested brackets of a statement", in_the_stack);
  add("--limit-unknowns", limits.engine.unknowns, "Unknowns of one model");
  add("--limit-message-bytes", limits.message_bytes, "Bytes of one message");
  app.add_option(
         "--limit-memory", limits.memory_bytes,
         "Bytes of models, states, matrices, snapshots, records, buffers and uploads; 0: 60 % "
         "of the machine's, or of what systemd or a container allows")
      ->group("Limits")
      ->capture_default_str()
      ->transform(CLI::AsSizeValue(false))
      ->check(NumberCheck::at_least(0));
  app.add_option(
         "--limit-identity-memory", limits.identity_memory_bytes,
         "The same, of what one identity has; 0: half of all where callers show credentials")
      ->group("Limits")
      ->capture_default_str()
      ->transform(CLI::AsSizeValue(false))
      ->check(NumberCheck::at_least(0));
  app.add_option("--limit-identity-sessions", limits.identity_sessions,
                 "Simulations of one identity; 0: half of all where callers show credentials")
      ->group("Limits")
      ->capture_default_str()
      ->check(NumberCheck::at_least(0));
  add("--limit-open-calls", limits.open_calls, "Calls and streams at once");
  add("--limit-identity-calls", limits.identity_calls,
      "Calls with one answer at once, of one identity");
  add("--limit-identity-streams", limits.identity_streams, "Streams at once, of one identity");
  add("--limit-connection-calls", limits.connection_calls,
      "Calls and streams at once over one connection");
  add("--limit-shared-memory-peers", limits.shared_memory_peers, "Peers over shared memory");
  add_checked("--limit-http-connections", limits.http_connections,
              "Connections served at once over HTTP, a thread each", NumberCheck::within(1, 10000));
  add("--limit-http-streams", limits.http_streams, "Streams of one identity over HTTP");
  add("--limit-deck-sockets", limits.deck_sockets, "Sockets that decks name, of all simulations");
  add("--limit-telemetry-samples", limits.telemetry_samples,
      "Samples buffered for one subscription");
  add("--limit-state-bytes", limits.state_bytes, "Bytes of all that is in the state folder");
  add("--limit-results-bytes", limits.results_bytes,
      "Bytes of the result files of one simulation, default and largest quota");
  add("--limit-results-root-bytes", limits.results_root_bytes,
      "Bytes of all result files in the folder of results, quotas of running simulations included");
  app.add_option("--lease", lease,
                 "Seconds that a simulation lives without calls, default and longest")
      ->group("Limits")
      ->capture_default_str()
      ->check(NumberCheck::within(1, kLongestTime));
}

// Every option is also an environment variable: --model-root is MBCOSIMD_MODEL_ROOT.
void add_environment_names(CLI::App& app) {
  for (CLI::Option* option : app.get_options()) {
    if (option->get_lnames().empty()) continue;
    const std::string& name = option->get_lnames().front();
    if (name == "help" || name == "version" || name == "print-config" || name == "hash-token" ||
        (name.compare(0, 5, "check") == 0 && name != "checkpoint-interval"))
      continue;
    option->envname(variable_of(name));
  }
}

/// Complains about variables that look like options and are none.
bool is_environment_good(const CLI::App& app) {
  std::vector<std::string> options;
  for (const CLI::Option* option : app.get_options())
    if (!option->get_envname().empty()) options.push_back(option->get_lnames().front());
  const std::vector<std::string> complaints = stray_variables(options, environ);
  for (const std::string& complaint : complaints)
    std::fprintf(stderr, "mbcosimd: error: %s\n", complaint.c_str());
  return complaints.empty();
}

/// Of names that are no options CLI11 says only that it "was not able to parse" them.
void complain_of_file(const CLI::App& app, const CLI::ConfigError& error) {
  const std::string text = error.what(), kExtra = CLI::ConfigError::Extras("").what();
  std::string told = text;
  if (text.rfind(kExtra, 0) == 0) {
    const std::string name = text.substr(kExtra.size());
    std::vector<std::string> options;
    for (const CLI::Option* option : app.get_options())
      if (option->get_configurable() && !option->get_lnames().empty())
        options.push_back(option->get_lnames().front());
    const std::string near = suggestion(name, options);
    told = "\"" + name + "\" is no option" +
           (near.empty() ? "; `mbcosimd --help` lists them" : "; " + near);
  }
  std::fprintf(stderr, "mbcosimd: error: in the file of options \"%s\": %s\n",
               app.get_config_ptr()->as<std::string>().c_str(), told.c_str());
}

const CLI::Validator is_daemon_id(
    [](std::string& id) {
      const bool good =
          !id.empty() && id.size() <= 16 &&
          id.find_first_not_of("abcdefghijklmnopqrstuvwxyz0123456789") == std::string::npos;
      return good ? "" : "1 to 16 of a to z and 0 to 9 are expected, not \"" + id + "\"";
    },
    "ID");

void add_check(CLI::App& app, HealthCheck& check) {
  const auto add = [&](const char* name, std::string& value, const char* help) {
    return app.add_option(name, value, help)->configurable(false)->group("Health of a daemon");
  };
  CLI::Option* address =
      add("--check", check.address, "Ask whether a daemon serves at ADDRESS; exit code 0 or 1");
  app.add_flag("--check-alive", check.alive, "Any answer will do, also of one that drains")
      ->configurable(false)
      ->group("Health of a daemon")
      ->needs(address);
  add("--check-ca", check.ca, "PEM file: it speaks TLS with a certificate of this authority")
      ->needs(address)
      ->check(CLI::ExistingFile);
  CLI::Option* certificate =
      add("--check-certificate", check.certificate, "PEM file: the client's certificate")
          ->needs(address)
          ->check(CLI::ExistingFile);
  CLI::Option* key =
      add("--check-key", check.key, "PEM file: its key")->needs(address)->check(CLI::ExistingFile);
  certificate->needs(key);
  key->needs(certificate);
  add("--check-name", check.name, "Name in the daemon's certificate, where ADDRESS is another")
      ->needs(address);
  app.add_option("--check-timeout", check.timeout, "Seconds after which no answer is one")
      ->configurable(false)
      ->group("Health of a daemon")
      ->capture_default_str()
      ->check(NumberCheck::within(1, 3600))
      ->needs(address);
}

/// As a file of options; those without a value as comments.
void print_options(const CLI::App& app) {
  std::istringstream lines(app.config_to_str(/*default_also=*/true, /*write_description=*/true));
  for (std::string line; std::getline(lines, line);) {
    const bool is_empty = line.size() > 3 && line.compare(line.size() - 3, 3, "=\"\"") == 0;
    std::printf("%s%s\n", is_empty ? "# " : "", line.c_str());
  }
}

int print_hash() {
  std::string token;
  if (!std::getline(std::cin, token) || token.empty() ||
      token.find_first_of(" \t\r#") != std::string::npos) {
    std::fprintf(stderr, "mbcosimd: error: expected a token without blanks, one line\n");
    return 4;
  }
  std::printf("%s\n", hash_of_token(token).c_str());
  return 0;
}

}  // namespace

Invocation read_options(int argc, char** argv) {
  Invocation invocation;
  Config& config = invocation.config;
  CLI::App app{"Multibody co-simulation server.", "mbcosimd"};
  app.set_version_flag("--version", std::string("mbcosimd ") + MBCOSIM_VERSION);
  // Here, as CLI11 reads the file before it looks at the environment.
  const char* file = std::getenv(variable_of("config").c_str());
  app.set_config("--config", file ? file : "", "File of options, one `name=value` a line",
                 file && *file);
  app.allow_config_extras(CLI::config_extras_mode::error);
  bool print_config = false, hash_token = false;
  std::int64_t lease = config.limits.lease.count(), grace = config.shutdown_grace.count(),
               drain = config.drain.count(), suspended_expiry = config.suspended_expiry.count();
  double checkpoint_interval = std::chrono::duration<double>(config.checkpoint_interval).count();

  app.add_option("--listen", config.listen,
                 "Addresses: unix:PATH or HOST:PORT; default: " + default_socket())
      ->check(AddressCheck::of_host_or_file());
  app.add_option("--model-root", config.model_root, "Folder of decks that clients may name")
      ->check(CLI::ExistingDirectory);
  app.add_option("--state-dir", config.state_dir,
                 "Folder of this daemon alone in which simulations outlive it")
      ->check(CLI::ExistingDirectory);
  app.add_option("--checkpoint-interval", checkpoint_interval,
                 "Seconds between two checkpoints of a simulation that changes")
      ->capture_default_str()
      ->check(NumberCheck::within(0.001, 1e6));
  app.add_option("--suspended-expiry", suspended_expiry,
                 "Seconds after which a suspended simulation is removed")
      ->capture_default_str()
      ->check(NumberCheck::within(1, kLongestTime));
  app.add_option("--resume", config.resume,
                 "When suspended simulations come back: lazy, each with the first call that needs "
                 "it; eager, all when the daemon starts")
      ->capture_default_str()
      ->check(CLI::IsMember({"lazy", "eager"}));
  app.add_option("--results-root", config.results_root,
                 "Folder in which simulations may have folders for result files")
      ->check(CLI::ExistingDirectory);
  app.add_option("--deck-sockets", config.deck_sockets,
                 "Folder in which decks may open the Unix sockets that they name, for simulations "
                 "that ask for it")
      ->check(CLI::ExistingDirectory);
  app.add_option("--workers", config.workers,
                 "Simulations that step at once; 0: one per core that the process may use")
      ->capture_default_str()
      ->check(NumberCheck::within(0, 4096));
  app.add_option(
         "--threads", config.threads,
         "Threads that work on a step of one large simulation, one for each 3000 unknowns at "
         "most; results do not depend on it. More than one pays where fewer simulations "
         "step than there are cores")
      ->capture_default_str()
      ->check(NumberCheck::within(1, 1024));
  app.add_option("--metrics", config.metrics, "HOST:PORT (IPv4) of Prometheus metrics")
      ->check(AddressCheck::of_host());
  app.add_option("--http", config.http,
                 "HOST:PORT (IPv4) of the page, of calls over HTTP (Connect, gRPC-Web) and of "
                 "/metrics")
      ->check(AddressCheck::of_host());
  app.add_option("--http-origin", config.http_origins,
                 "Web site under which a proxy shows this daemon: https://HOST")
      ->group("Security")
      ->needs("--http");
  app.add_option("--shutdown-grace", grace, "Seconds that open calls get on SIGTERM")
      ->capture_default_str()
      ->check(NumberCheck::within(0, 86400));
  app.add_option("--drain", drain,
                 "Seconds on SIGTERM in which health says NOT_SERVING and all calls are served, so "
                 "that balancers look elsewhere; a second SIGTERM ends them")
      ->capture_default_str()
      ->check(NumberCheck::within(0, 86400));
  app.add_option("--daemon-id", config.daemon_id,
                 "Begins the names of this daemon's simulations, so that a proxy can tell whose "
                 "they are; default: none, or the one in --state-dir")
      ->check(is_daemon_id);
  app.add_flag("--reflection,!--no-reflection", config.reflection, "Serve gRPC reflection")
      ->default_str("true");
  app.add_flag("--health-credentials", config.health_credentials,
               "Health asks for credentials when the service does")
      ->group("Security");
  app.add_flag(
         "--shared-memory,!--no-shared-memory", config.shared_memory,
         "Beside each unix:PATH, let peers of this host exchange through shared memory: PATH.shm")
      ->default_str("true");
  app.add_option("--log-level", config.log_level, "trace, debug, info, warn, error, off")
      ->capture_default_str()
      ->check(CLI::IsMember({"trace", "debug", "info", "warn", "error", "off"}));
  app.add_option("--log-format", config.log_format, "text or json")
      ->capture_default_str()
      ->check(CLI::IsMember({"text", "json"}));
  app.add_option("--tls-certificate", config.tls_certificate, "PEM file")
      ->group("Security")
      ->check(CLI::ExistingFile);
  app.add_option("--tls-key", config.tls_key, "PEM file")
      ->group("Security")
      ->check(CLI::ExistingFile);
  app.add_option("--tls-client-ca", config.tls_client_ca,
                 "PEM file; clients need a certificate of this authority")
      ->group("Security")
      ->check(CLI::ExistingFile);
  app.add_option(
         "--certificate-role", config.certificate_roles,
         "NAME=ROLE: who has a certificate of this name (its first URI, else its subject as "
         "in \"CN=arm,O=Plant\") has the role observe, control or admin; default: control. "
         "May be repeated")
      ->group("Security")
      ->allow_extra_args(false);
  app.add_option("--tokens", config.tokens_file,
                 "File of lines `TOKEN ROLE NAME [EXPIRY]`; tokens themselves or as --hash-token "
                 "prints them")
      ->group("Security")
      ->check(CLI::ExistingFile);
  app.add_flag("--insecure", config.insecure,
               "Allow TCP without credentials, and addresses other than loopback without TLS")
      ->group("Security");
  add_limits(app, config.limits, lease);
  add_environment_names(app);
  add_check(app, invocation.check);
  app.add_flag("--hash-token", hash_token,
               "Read a token from the standard input and print it as the tokens file keeps it")
      ->configurable(false)
      ->group("Security");
  app.add_flag("--print-config", print_config, "Print the options in force and exit")
      ->configurable(false);

  try {
    app.parse(argc, argv);
  } catch (const CLI::ConfigError& error) {
    complain_of_file(app, error);
    invocation.exit_code = 4;
    return invocation;
  } catch (const CLI::ParseError& error) {
    invocation.exit_code = app.exit(error) == 0 ? 0 : 4;
    return invocation;
  }
  if (!is_environment_good(app)) {
    invocation.exit_code = 4;
    return invocation;
  }
  if (hash_token) {
    invocation.exit_code = print_hash();
    return invocation;
  }
  config.limits.lease = std::chrono::seconds(lease);
  config.shutdown_grace = std::chrono::seconds(grace);
  config.drain = std::chrono::seconds(drain);
  config.suspended_expiry = std::chrono::seconds(suspended_expiry);
  config.checkpoint_interval =
      std::chrono::milliseconds(static_cast<std::int64_t>(checkpoint_interval * 1000));
  if (config.listen.empty()) config.listen.push_back(default_socket());
  if (print_config) {
    print_options(app);
    invocation.exit_code = 0;
  }
  return invocation;
}

}  // namespace mbcosim::server
