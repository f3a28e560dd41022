#include "host/cli/daemon_question.hpp"

#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>

#include "host/rpc/client.hpp"

namespace diastole {

void print_json(const nlohmann::json& document) { std::cout << document.dump(2) << '\n'; }

void print(const CommandOutput& out, const nlohmann::json& document, const std::function<void()>& show) {
  out.json ? print_json(document) : show();
}

void add_question(CommandLine& line, const DaemonQuestion& question) {
  auto daemon = std::make_shared<DaemonAddress>();
  CLI::App* command = line.add(question.command, question.purpose, question.examples);
  daemon->add_to(*command);
  if (question.gives_order) daemon->add_take_over_to(*command);
  line.on_run(command, [daemon, question](const CommandOutput& out) {
    DaemonClient client = daemon->connect();
    const nlohmann::json answer = client.call(question.method, nlohmann::json::object(), question.patience);
    print(out, answer, [&] { question.show(answer); });
    return question.positive(answer) ? ExitCode::done : ExitCode::negative;
  });
}

}  // namespace diastole
