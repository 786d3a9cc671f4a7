// Starts `mbcosim lsp` for decks: diagnostics while one types, completion, hover, definitions.
const { workspace, window } = require("vscode");
const { LanguageClient } = require("vscode-languageclient/node");

let client;

exports.activate = async () => {
  const program = workspace.getConfiguration("mbcosim").get("program");
  client = new LanguageClient("mbcosim", "mbcosim", { command: program, args: ["lsp"] },
                              { documentSelector: [{ language: "mbcosim" }] });
  try {
    await client.start();
  } catch (error) {
    window.showErrorMessage(`mbcosim: cannot start "${program} lsp" (${error.message}); set mbcosim.program to its path`);
  }
};

exports.deactivate = () => client && client.stop();
