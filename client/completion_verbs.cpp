// completion: what a shell needs to complete bedflow's command lines; and the question that it then asks.
#include "command_line.h"
#include "completion.h"
#include "connection.h"

namespace bedflow::client {

namespace {

// Bash breaks words at "=", ":" and "@" and replaces what is behind: $2.
constexpr const char* bash_script = R"(# Completion of bedflow in bash: source <(bedflow completion bash)
_bedflow() {
  local line="${COMP_LINE:0:COMP_POINT}" word kept candidate
  word="${line##*[[:space:]]}"
  kept="${word%"$2"}"
  COMPREPLY=()
  while IFS=$'\t' read -r candidate _; do
    if [[ $candidate == :files ]]; then
      compopt -o default 2>/dev/null
    else
      COMPREPLY+=("${candidate#"$kept"}")
    fi
  done < <("$1" __complete "$line" 2>/dev/null)
}
complete -F _bedflow bedflow
)";

constexpr const char* zsh_script = R"(#compdef bedflow
# Completion of bedflow in zsh: source <(bedflow completion zsh)
_bedflow() {
  local -a candidates
  local line files=0
  for line in "${(@f)$("${words[1]}" __complete "${(j: :)words[1,CURRENT-1]} $PREFIX" 2>/dev/null)}"; do
    case $line in
      '') ;;
      :files) files=1 ;;
      *) candidates+=("${${line%%$'\t'*}//:/\\:}:${line#*$'\t'}") ;;
    esac
  done
  (( ${#candidates} )) && _describe 'bedflow' candidates
  (( files )) && _files
}
if [[ ${funcstack[1]} == _bedflow ]]; then _bedflow "$@"; else compdef _bedflow bedflow; fi
)";

constexpr const char* fish_script = R"(# Completion of bedflow in fish: bedflow completion fish | source
function __bedflow_complete
    set -l words (commandline -xpc 2>/dev/null; or commandline -opc)
    for line in ($words[1] __complete (commandline -cp | string collect) 2>/dev/null)
        switch $line
            case :files
                __fish_complete_path (commandline -ct)
            case '*'
                echo $line
        end
    end
end
complete -c bedflow -f -a '(__bedflow_complete)'
)";

struct ScriptOptions {
  std::string shell;
};

Exit print_script(const Program&, const ScriptOptions& options) {
  print_data(options.shell == "bash" ? bash_script : options.shell == "zsh" ? zsh_script : fish_script);
  return Exit::ok;
}

struct QuestionOptions {
  std::string line;
};

// A candidate a line, with its note behind a tab; ":files" for file names.
Exit answer(const Program& program, const QuestionOptions& options) {
  Program other;
  const auto app = command_line(other);
  const auto completion = complete(*app, options.line, program.server);
  std::string text;
  for (const auto& one : completion.candidates) text += one.text + "\t" + one.note + "\n";
  if (completion.files) text += ":files\n";
  print_data(text);
  return Exit::ok;
}

}  // namespace

void add_completion_verbs(CLI::App& app, Program& program) {
  const auto script = std::make_shared<ScriptOptions>();
  auto* verb = app.add_subcommand("completion", "print what bash, zsh or fish needs to complete bedflow's lines");
  verb->add_option("shell", script->shell, "bash, zsh or fish")->required()->check(CLI::IsMember({"bash", "zsh", "fish"}));
  verb->footer(
      "bash: source <(bedflow completion bash), in ~/.bashrc\nzsh:  source <(bedflow completion zsh), in ~/.zshrc behind "
      "compinit\n"
      "fish: bedflow completion fish | source, in ~/.config/fish/config.fish");
  on_call(verb, program, script, print_script);

  const auto question = std::make_shared<QuestionOptions>();
  verb = app.add_subcommand("__complete", "")->group("");
  verb->add_option("line", question->line)->required();
  on_call(verb, program, question, answer);
}

}  // namespace bedflow::client
