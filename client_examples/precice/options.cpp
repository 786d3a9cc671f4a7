#include "options.h"

#include <charconv>
#include <fstream>
#include <map>
#include <sstream>
#include <stdexcept>

const char* const kUsage =
    "usage: mbcosim_participant ADDRESS CONFIGURATION PARTICIPANT MESH MODEL DATA...\n"
    "\n"
    "  ADDRESS        of the daemon: unix:PATH or HOST:PORT\n"
    "  CONFIGURATION  preCICE's; PARTICIPANT and MESH are names in it\n"
    "\n"
    "MODEL is one of\n"
    "  --deck DECK --nodes 2,3            these nodes of a deck\n"
    "  --deck DECK --port PORT            a port that the deck has\n"
    "  --simulation NAME --port PORT      a port of a simulation that another client has loaded\n"
    "\n"
    "DATA are names in the configuration, at least one read and one written:\n"
    "  --force NAME         read: forces on the points [N]\n"
    "  --moment NAME        read: moments about the points [N m]\n"
    "  --displacement NAME  written: from where the points were at the start [m]\n"
    "  --velocity NAME      written: velocities of the points [m/s]\n"
    "\n"
    "To a daemon that wants to know who calls:\n"
    "  --token-file FILE    with a bearer token\n"
    "  --ca FILE            certificate of the daemon's authority: the connection uses TLS\n";

namespace {

std::vector<int> read_labels(const std::string& list) {
  std::vector<int> labels;
  const char* at = list.data();
  const char* const end = at + list.size();
  for (;;) {
    int label = 0;
    const auto [rest, error] = std::from_chars(at, end, label);
    if (error != std::errc() || (rest != end && *rest != ','))
      throw std::invalid_argument("--nodes: labels with commas between them, e.g. 2,3; got \"" +
                                  list + "\"");
    labels.push_back(label);
    if (rest == end) return labels;
    at = rest + 1;
  }
}

std::string text_of(const std::string& file) {
  std::ifstream in(file);
  std::ostringstream text;
  text << in.rdbuf();
  if (!in || text.str().empty()) throw std::invalid_argument("cannot read \"" + file + '"');
  return text.str();
}

mbcosim::client::Credentials read_credentials(const std::string& token_file,
                                              const std::string& server_ca) {
  mbcosim::client::Credentials credentials;
  if (!token_file.empty()) std::istringstream(text_of(token_file)) >> credentials.token;
  if (!server_ca.empty()) credentials.server_ca = text_of(server_ca);
  return credentials;
}

void check(const Options& options) {
  if (options.deck.empty() == options.simulation.empty())
    throw std::invalid_argument("one of --deck and --simulation is needed");
  if (options.port.empty() == options.nodes.empty())
    throw std::invalid_argument("one of --port and --nodes is needed");
  if (options.deck.empty() && options.port.empty())
    throw std::invalid_argument("--nodes belongs to --deck: name a --port of the simulation");
  const DataNames& data = options.data;
  if (data.force.empty() && data.moment.empty())
    throw std::invalid_argument("nothing is read: name --force or --moment");
  if (data.displacement.empty() && data.velocity.empty())
    throw std::invalid_argument("nothing is written: name --displacement or --velocity");
}

}  // namespace

Options read_options(int argc, const char* const* argv) {
  constexpr int kPositional = 4;
  if (argc <= kPositional) throw std::invalid_argument("too few arguments");
  Options options{argv[1], argv[2], argv[3], argv[4], {}, {}, {}, {}, {}, {}};
  std::string nodes, token_file, server_ca;
  const std::map<std::string, std::string*> known = {{"--deck", &options.deck},
                                                     {"--simulation", &options.simulation},
                                                     {"--port", &options.port},
                                                     {"--nodes", &nodes},
                                                     {"--force", &options.data.force},
                                                     {"--moment", &options.data.moment},
                                                     {"--displacement", &options.data.displacement},
                                                     {"--velocity", &options.data.velocity},
                                                     {"--token-file", &token_file},
                                                     {"--ca", &server_ca}};
  for (int i = kPositional + 1; i < argc; i += 2) {
    const auto option = known.find(argv[i]);
    if (option == known.end())
      throw std::invalid_argument("unknown option \"" + std::string(argv[i]) + "\"");
    if (i + 1 == argc) throw std::invalid_argument(option->first + " needs a value");
    *option->second = argv[i + 1];
  }
  if (!nodes.empty()) options.nodes = read_labels(nodes);
  options.credentials = read_credentials(token_file, server_ca);
  check(options);
  return options;
}
