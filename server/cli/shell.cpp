#include "cli/shell.h"

namespace mbcosim::cli {
namespace {

using Options = std::vector<const CLI::Option*>;

std::vector<const CLI::App*> commands_of(const CLI::App& app) {
  return app.get_subcommands([](const CLI::App* command) { return !command->get_name().empty(); });
}

/// Those that begin with a dash.
Options flags_of(const CLI::App& command) {
  return command.get_options([](const CLI::Option* option) { return option->nonpositional(); });
}

std::vector<std::string> spellings(const CLI::Option& option) {
  std::vector<std::string> words;
  for (const std::string& name : option.get_snames()) words.push_back("-" + name);
  for (const std::string& name : option.get_lnames()) words.push_back("--" + name);
  return words;
}

std::string joined(const std::vector<std::string>& words, const std::string& between) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : between) + word;
  return text;
}

std::string flag_words(const CLI::App& command) {
  std::vector<std::string> words;
  for (const CLI::Option* option : flags_of(command))
    for (const std::string& word : spellings(*option)) words.push_back(word);
  return joined(words, " ");
}

std::string command_words(const CLI::App& app) {
  std::vector<std::string> names;
  for (const CLI::App* command : commands_of(app)) names.push_back(command->get_name());
  return joined(names, " ");
}

/// Between single quotes of a shell.
std::string shell_quoted(const std::string& text) {
  std::string result;
  for (const char c : text) result += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return "'" + result + "'";
}

std::string bash_script(const CLI::App& app) {
  std::string text =
      "_mbcosim() {\n  local word=\"${COMP_WORDS[COMP_CWORD]}\" words=\n"
      "  if [ \"$COMP_CWORD\" -eq 1 ]; then words=" +
      shell_quoted(command_words(app) + " --help --version") +
      "\n  elif [ \"${word#-}\" != \"$word\" ]; then\n    case \"${COMP_WORDS[1]}\" in\n";
  for (const CLI::App* command : commands_of(app))
    text +=
        "      " + command->get_name() + ") words=" + shell_quoted(flag_words(*command)) + " ;;\n";
  return text +
         "    esac\n  fi\n  COMPREPLY=($(compgen -W \"$words\" -- \"$word\"))\n}\n"
         "complete -o default -o bashdefault -F _mbcosim mbcosim\n";
}

std::string zsh_script(const CLI::App& app) {
  std::string text = "#compdef mbcosim\n_mbcosim() {\n  if (( CURRENT == 2 )); then\n    compadd " +
                     command_words(app) + "\n    return\n  fi\n  case $words[2] in\n";
  for (const CLI::App* command : commands_of(app))
    text += "    " + command->get_name() + ") [[ $PREFIX == -* ]] && compadd -- " +
            flag_words(*command) + " || _files ;;\n";
  return text + "    *) _files ;;\n  esac\n}\ncompdef _mbcosim mbcosim\n";
}

std::string fish_script(const CLI::App& app) {
  std::string text;
  for (const CLI::App* command : commands_of(app)) {
    text += "complete -c mbcosim -n __fish_use_subcommand -a " + command->get_name() + " -d " +
            shell_quoted(command->get_description()) + "\n";
    for (const CLI::Option* option : flags_of(*command)) {
      text += "complete -c mbcosim -n '__fish_seen_subcommand_from " + command->get_name() + "'";
      for (const std::string& name : option->get_snames()) text += " -s " + name;
      for (const std::string& name : option->get_lnames()) text += " -l " + name;
      text += " -d " + shell_quoted(option->get_description()) + "\n";
    }
  }
  return text;
}

/// A text in roff: no line begins with a dot, dashes stay dashes.
std::string roff(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '\\' || c == '-') result += '\\';
    result += c == '\n' ? ' ' : c;
  }
  return result.starts_with(".") || result.starts_with("'") ? "\\&" + result : result;
}

std::string option_entry(const CLI::Option& option) {
  const bool takes_value = option.get_items_expected_max() > 0;
  const std::string heading = option.nonpositional()
                                  ? joined(spellings(option), ", ") + (takes_value ? " VALUE" : "")
                                  : option.get_name();
  return ".TP\n.B " + roff(heading) + "\n" + roff(option.get_description()) + "\n";
}

}  // namespace

std::string completion_script(const CLI::App& app, const std::string& shell) {
  return shell == "bash" ? bash_script(app) : shell == "zsh" ? zsh_script(app) : fish_script(app);
}

std::string manual_page(const CLI::App& app) {
  std::string text = ".TH MBCOSIM 1\n.SH NAME\nmbcosim \\- " + roff(app.get_description()) +
                     "\n.SH SYNOPSIS\n.B mbcosim\n.I command\n[options]\n.SH COMMANDS\n";
  for (const CLI::App* command : commands_of(app)) {
    text += ".SS " + roff(command->get_name()) + "\n" + roff(command->get_description()) + ".\n";
    for (const CLI::Option* option : command->get_options()) text += option_entry(*option);
  }
  return text + ".SH EXIT STATUS\n" + roff(app.get_footer()) + "\n.SH SEE ALSO\n.BR mbcosimd (1)\n";
}

}  // namespace mbcosim::cli
