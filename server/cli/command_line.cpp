#include <algorithm>
#include <cstdio>
#include <string>
#include <string_view>
#include <vector>

#include "cli/cli11.h"
#include "cli/commands.h"
#include "cli/shell.h"
#include "input/suggest.h"
#include "input/symbol_values.h"
#include "options/address_checks.h"
#include "options/number_checks.h"
#include "reduction/job.h"

namespace {

constexpr const char* kFooter =
    "Exit codes: 0 done, 1 results differ, 2 deck refused, 3 numerical failure, 4 refused or limit "
    "exceeded, "
    "5 an external code is missing or lost, 6 internal error, 130 interrupted.\n"
    "The daemon is `mbcosimd`; clients are under client_examples/.";

/// The first word names no command: CLI11 would ask for one as if there were none. Empty: it does.
std::string unknown_command(CLI::App& app, int argc, char** argv) {
  if (argc < 2 || argv[1][0] == '-') return "";
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    names.push_back(command->get_name());
  const std::string word = argv[1];
  if (std::find(names.begin(), names.end(), word) != names.end()) return "";
  const std::string near = mbcosim::suggestion(word, names);
  return "there is no command \"" + word.substr(0, 100) + "\"" +
         (near.empty() ? "; `mbcosim --help` lists them" : "; " + near);
}

/// `mbcosim reduce`: each option of a job is one of the command line too.
void add_reduce(CLI::App& app, mbcosim::cli::ReduceCommand& command, int& exit_code) {
  CLI::App* reduce_app = app.add_subcommand(
      "reduce", "Reduce a finite element model to a FEM data file for the modal joint");
  reduce_app->add_option("job", command.job,
                         "File of lines `name = value` with the options below; files that it names "
                         "are relative to it");
  reduce_app
      ->add_option("-o,--output", command.output,
                   "FEM data file to write; the packed form when its name ends with .bin")
      ->required();
  reduce_app->add_flag("-q,--quiet", command.quiet, "No progress bar and no report");
  reduce_app
      ->add_option("--threads", command.threads,
                   "Threads of the factorizations; results are the same for every number; default: "
                   "all cores that the process may use")
      ->check(mbcosim::server::NumberCheck::within(1, mbcosim::cli::kMostThreads));
  for (const mbcosim::ReductionOptionHelp& option : mbcosim::reduction_option_help())
    reduce_app->add_option_function<std::string>(
        std::string("--") + option.name,
        [&command, name = std::string(option.name)](const std::string& value) {
          command.options.emplace_back(name, value);
        },
        option.help);
  reduce_app->callback([&] { exit_code = reduce_model(command); });
}

/// Subcommands that are programs of their own.
void add_programs(CLI::App& app, int& exit_code) {
  const auto add_to = [&](const std::string& program, const std::string& name, const char* text) {
    CLI::App* command = app.add_subcommand(name, text);
    command->prefix_command();
    command->set_help_flag();
    command->callback([command, program, name, &exit_code] {
      std::vector<std::string> arguments = command->remaining();
      if (program == "sessions") arguments.insert(arguments.begin(), name);
      exit_code = mbcosim::cli::hand_over(program, arguments);
    });
  };
  const auto add = [&](const std::string& name, const char* text) { add_to(name, name, text); };
  add("fmu", "Make an FMU of a deck, for co-simulation in other tools");
  add("peer",
      "Let an FMU, or a code that speaks MBDyn's protocol, take part in a daemon's simulation");
  add("replay", "Run a model against a record of its ports, or a recorded server against a client");
  add_to("sessions", "sessions", "List a daemon's simulations, suspended ones too");
  add_to("sessions", "checkpoint", "Store all of a daemon's simulation in a file");
  add_to("sessions", "resume", "Make a simulation of such a file, or bring a suspended one back");
}

/// `-D NAME=VALUE`, any number of times.
void add_symbols(CLI::App& app, mbcosim::SymbolValues& symbols) {
  app.add_option_function<std::vector<std::string>>(
         "-D,--define",
         [&symbols](const std::vector<std::string>& definitions) {
           for (const std::string& definition : definitions) {
             auto symbol = mbcosim::parse_symbol(definition);
             if (!symbol) throw CLI::ValidationError("-D", symbol.error().message);
             if (!symbols.insert(std::move(*symbol)).second)
               throw CLI::ValidationError("-D", "\"" + definition + "\": the name is given twice");
           }
         },
         "Give a symbol of the deck another value: NAME=VALUE takes the place of what its first "
         "declaration says; numbers, TRUE, FALSE or text")
      ->allow_extra_args(false);
}

/// `--node 3 z` and its like, any number of times.
void add_curve(CLI::App& app, const std::string& name, const std::string& ending,
               std::vector<mbcosim::cli::CurveRequest>& curves, const char* help) {
  app.add_option_function<std::vector<std::pair<int, std::string>>>(
         name,
         [ending, &curves](const std::vector<std::pair<int, std::string>>& wanted) {
           for (const auto& [label, quantity] : wanted) curves.push_back({ending, label, quantity});
         },
         help)
      ->type_name("LABEL QUANTITY");
}

void add_plot(CLI::App& app, mbcosim::cli::PlotCommand& command, int& exit_code) {
  CLI::App* plot =
      app.add_subcommand("plot", "Draw results over time: on the terminal, or into a picture");
  plot->add_option("prefix", command.prefix, "Prefix of the result files of a run")->required();
  add_curve(*plot, "--node", "mov", command.curves,
            "Of a node: x y z, e1 e2 e3 (Euler angles [deg], or the rotation vector [rad]), vx.., "
            "wx.., ax.., the vectors X E V W, or "
            "the number of a column of .mov after the label");
  add_curve(*plot, "--joint", "jnt", command.curves,
            "Of a joint: fx fy fz mx my mz in its frame, Fx .. Mz in the global one, the vectors "
            "f m F M, or the number of a column of .jnt after the label");
  plot->add_option_function<std::vector<std::tuple<std::string, int, std::string>>>(
          "--column",
          [&command](const std::vector<std::tuple<std::string, int, std::string>>& wanted) {
            for (const auto& [ending, label, column] : wanted)
              command.curves.push_back({ending, label, column});
          },
          "Of any result file: its ending (hyd, abs, frc, ..), label, number of the column after "
          "the label")
      ->type_name("ENDING LABEL NUMBER");
  plot->add_option("--png", command.picture,
                   "Picture to write (.png, .svg or .pdf), by gnuplot or Python's matplotlib");
  plot->callback([&] {
    if (command.curves.empty())
      throw CLI::ValidationError("plot", "say what to draw: --node 3 z, --joint 5 F");
    exit_code = mbcosim::cli::plot(command);
  });
}

void add_diff(CLI::App& app, mbcosim::cli::DiffCommand& command, int& exit_code) {
  CLI::App* diff =
      app.add_subcommand("diff", "Compare the results of two runs; exit code 1 when they differ");
  diff->add_option("first", command.first, "Prefix of result files")->required();
  diff->add_option("second", command.second, "Prefix of result files")->required();
  diff->add_option("--relative", command.relative,
                   "Tolerance, as a part of the largest value of the column")
      ->capture_default_str()
      ->check(mbcosim::server::NumberCheck::at_least(0));
  diff->add_option("--absolute", command.absolute, "Differences up to this one do not count")
      ->capture_default_str()
      ->check(mbcosim::server::NumberCheck::at_least(0));
  diff->callback([&] { exit_code = mbcosim::cli::diff(command); });
}

void add_eig(CLI::App& app, mbcosim::cli::EigCommand& command, int& exit_code) {
  CLI::App* eig =
      app.add_subcommand("eig", "Print the eigenvalues of a deck: frequencies and damping");
  eig->add_option("deck", command.deck, "Main file of the deck")->required();
  add_symbols(*eig, command.symbols);
  eig->add_option("-n,--count", command.count,
                  "How many, those nearest to --near; 0: all finite ones")
      ->capture_default_str()
      ->check(mbcosim::server::NumberCheck::at_least(0));
  eig->add_option("--near", command.shift, "Frequency [Hz] near which they are wanted")
      ->capture_default_str()
      ->check(mbcosim::server::NumberCheck::at_least(0));
  eig->add_option("--time", command.time, "Run the deck to this time first")
      ->check(mbcosim::server::NumberCheck::finite());
  eig->callback([&] { exit_code = mbcosim::cli::eig(command); });
}

/// What a user meets first and what shells are told.
void add_starts(CLI::App& app, std::string& word, std::string& output, int& exit_code) {
  CLI::App* init = app.add_subcommand("init", "Write a commented deck to start from");
  init->add_option("kind", word, "pendulum, beam, hydraulic or coupled")->required();
  init->add_option("-o,--output", output, "File to write; default: KIND.mbd");
  init->callback([&] { exit_code = mbcosim::cli::init(word, output); });
  CLI::App* completion = app.add_subcommand(
      "completion", "Print a completion script: source <(mbcosim completion bash)");
  completion->add_option("shell", word, "bash, zsh or fish")
      ->required()
      ->check(CLI::IsMember({"bash", "zsh", "fish"}));
  completion->callback(
      [&] { std::fputs(mbcosim::cli::completion_script(app, word).c_str(), stdout); });
  CLI::App* lsp = app.add_subcommand(
      "lsp",
      "Serve an editor: diagnostics, completion, hover, definitions (Language Server Protocol)");
  lsp->add_flag_callback(
      "--stdio", [] {}, "On the standard input and output, as always");
  lsp->callback([&] { exit_code = mbcosim::cli::language_server(); });
  CLI::App* man = app.add_subcommand("man", "Print the manual page: mbcosim man | man -l -");
  man->callback([&] { std::fputs(mbcosim::cli::manual_page(app).c_str(), stdout); });
}

/// All but `run`, and what their options give.
struct OtherCommands {
  void add(CLI::App& app, int& exit_code);

  std::string deck, convert, word, output, http = "127.0.0.1:0";
  bool json = false;
  mbcosim::SymbolValues symbols;
  mbcosim::cli::ReduceCommand reduce_command;
  mbcosim::cli::PlotCommand plot_command;
  mbcosim::cli::DiffCommand diff_command;
  mbcosim::cli::EigCommand eig_command;
};

void OtherCommands::add(CLI::App& app, int& exit_code) {
  using namespace mbcosim::cli;
  const auto add_report = [&](const char* name, const char* help, const char* json_help,
                              auto* report) {
    CLI::App* report_app = app.add_subcommand(name, help);
    report_app->add_option("deck", deck, "Main file of the deck")->required();
    add_symbols(*report_app, symbols);
    report_app->add_flag("--json", json, json_help);
    report_app->callback([this, &exit_code, report] { exit_code = report(deck, symbols, json); });
  };
  add_report("validate", "Read a deck and report all that is wrong with it",
             "Print the diagnostics as JSON", &validate);
  add_report("describe", "List a deck's nodes, elements and variables",
             "Print the description as JSON", &describe);

  add_reduce(app, reduce_command, exit_code);
  CLI::App* fem_app = app.add_subcommand("fem-info", "Tell what a FEM data file holds");
  fem_app->add_option("file", deck, "FEM data file, text or binary")->required();
  fem_app->add_flag("--json", json, "Print it as JSON");
  fem_app->add_option("--convert", convert,
                      "Write a copy to this file; the packed form when its name ends with .bin");
  fem_app->callback([this, &exit_code] { exit_code = fem_info(deck, json, convert); });

  add_programs(app, exit_code);
  add_plot(app, plot_command, exit_code);
  add_diff(app, diff_command, exit_code);
  add_eig(app, eig_command, exit_code);
  add_starts(app, word, output, exit_code);

  CLI::App* view_app = app.add_subcommand(
      "view", "Show a deck in a browser: starts a daemon of its own and prints the address");
  view_app->add_option("deck", deck, "Main file of the deck")->required();
  view_app->add_option("--http", http, "HOST:PORT of the page; port 0: any that is free")
      ->capture_default_str()
      ->check(mbcosim::server::AddressCheck::of_host());
  view_app->callback([this, &exit_code] { exit_code = view(deck, http); });

  CLI::App* keywords_app = app.add_subcommand(
      "keywords", "List the words of the input language; refused ones are marked");
  keywords_app->add_flag("--json", json, "Print the list as JSON");
  keywords_app->callback([this, &exit_code] { exit_code = keywords(json); });
}

}  // namespace

int mbcosim::cli::command_line(int argc, char** argv) {
  open_streams();
  CLI::App app{"Multibody and co-simulation solver for decks in MBDyn's input language.",
               "mbcosim"};
  app.set_version_flag("--version", std::string("mbcosim ") + MBCOSIM_VERSION);
  app.require_subcommand(1);
  app.footer(kFooter);

  int exit_code = kDone;
  RunOptions run_options;
  CLI::App* run_app =
      app.add_subcommand("run", "Run a deck to its final time and write the results");
  run_app
      ->add_option("deck", run_options.deck,
                   "Main file of the deck; also a pipe, as /dev/stdin, with `-o`")
      ->required();
  run_app->add_option("-o,--output", run_options.prefix,
                      "Prefix of the result files (PREFIX.mov, PREFIX.jnt, ...), or a folder for "
                      "files of the deck's name; default: the deck's name without ending");
  run_app
      ->add_option("--format", run_options.formats,
                   "Format of the results, text or netcdf, whatever the deck asks for; may be "
                   "given twice")
      ->check(CLI::IsMember({"text", "netcdf"}))
      ->allow_extra_args(false);
  add_symbols(*run_app, run_options.symbols);
  run_app->add_flag("-q,--quiet", run_options.quiet,
                    "No progress bar and no summary on a terminal");
  run_app->add_flag("!--no-deck-sockets", run_options.deck_sockets,
                    "Open no socket and no file that the deck names for external codes: their "
                    "values stay as they start");
  run_app
      ->add_option("--peer-timeout", run_options.peer_timeout,
                   "Longest wait for an external code [s]")
      ->capture_default_str()
      ->check(mbcosim::server::NumberCheck::within(1e-3, 1e6));
  run_app->add_flag("--padded-labels", run_options.pads_labels,
                    "The codes pad labels of an odd number of points, as MBDyn does: they do not "
                    "use its client library, which misreads them");
  run_app->add_flag("--real-time", run_options.real_time,
                    "Hold the run back to the wall clock; steps that end late are counted");
  run_app
      ->add_option(
          "--threads", run_options.threads,
          "Threads that work on a large model, one for each 3000 unknowns at most; results "
          "do not depend on it; default: all cores that the process "
          "may use")
      ->check(mbcosim::server::NumberCheck::within(1, mbcosim::cli::kMostThreads));
  run_app->callback([&] { exit_code = run(run_options); });

  OtherCommands others;
  // Their options take longer than a small deck to read.
  if (argc < 2 || std::string_view(argv[1]) != "run") others.add(app, exit_code);

  if (const std::string unknown = unknown_command(app, argc, argv); !unknown.empty()) {
    std::fprintf(stderr, "mbcosim: %s\n", unknown.c_str());
    return kRefused;
  }
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& e) {
    return app.exit(e) == 0 ? kDone : kRefused;
  }
  return exit_code;
}
