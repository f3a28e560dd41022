#include "tools/diastole/batch/batch_file.hpp"

#include <fmt/format.h>
#include <glob.h>

#include <algorithm>
#include <array>
#include <map>
#include <string_view>

#include "protocol/contract/input_error.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole::batch {
namespace {

namespace fs = std::filesystem;

/// Sorted; empty if nothing is of that form.
std::vector<fs::path> files_like(const fs::path& pattern) {
  glob_t found{};
  std::vector<fs::path> files;
  if (::glob(pattern.c_str(), 0, nullptr, &found) == 0) {
    for (size_t i = 0; i < found.gl_pathc; ++i)
      files.emplace_back(found.gl_pathv[i]);
  }
  ::globfree(&found);
  return files;
}

/// "gel-7" of "gels/gel-7.study.toml" and of "gels/gel-7/".
std::string stem_of(const fs::path& input) {
  const fs::path plain = input.has_filename() ? input : input.parent_path();
  const std::string name = plain.filename().string();
  return name.substr(0, name.find('.'));
}

std::vector<std::string> outputs_of(const std::string& command, const fs::path& base) {
  if (command == "explain") return {"-o", base.string()};
  if (command == "track") return {"-o", base.string() + ".tags.csv", "--force"};
  return {};
}

/// "-o", and "-oX", which is the same to the command.
bool is_short(const std::string& argument, char letter) {
  return argument.size() > 1 && argument[0] == '-' && argument[1] == letter;
}

/// The option of "--page=X".
std::string option_of(const std::string& argument) { return argument.substr(0, argument.find('=')); }

/// Files that are written by options which some commands have besides; several jobs cannot share one.
constexpr std::array<std::string_view, 4> shared_outputs{"--page", "--record", "--checkpoint", "--cells"};

void check_arguments(const TableReader& table, const Batch& batch, const std::vector<std::string>& arguments,
                     size_t inputs) {
  for (const std::string& argument : arguments) {
    const std::string option = option_of(argument);
    if (is_short(argument, 'h') || option == "--help")
      table.fail("arguments", fmt::format("\"{}\" only prints help", argument), "Leave it out.");
    if (is_short(argument, 'o') || option == "--json" || option == "--output")
      table.fail("arguments", fmt::format("\"{}\" is set by the batch", argument),
                 fmt::format("Leave it out: results go to {}.", batch.output.string()));
    if (inputs > 1 && std::ranges::find(shared_outputs, option) != shared_outputs.end())
      table.fail("arguments", fmt::format("\"{}\" would be one file of {} jobs", argument, inputs),
                 "Leave it out, or give each input a [[job]] of its own.");
  }
}

void add_jobs(Batch& batch, TableReader& table, std::map<std::string, int>& names) {
  const std::string command = table.choice("command", {"fit", "explain", "montecarlo", "track"});
  const auto arguments = table.texts_or("arguments", {});
  std::vector<fs::path> inputs;
  for (const std::string& pattern : table.texts_or("inputs", {})) {
    const auto found = files_like(batch.file.parent_path() / pattern);
    if (found.empty())
      table.fail("inputs", fmt::format("nothing is like \"{}\"", pattern),
                 "Check the path; it counts from the batch file.");
    inputs.insert(inputs.end(), found.begin(), found.end());
  }
  if (inputs.empty()) table.fail("inputs", "names no input", "Give studies, or image folders for track.");
  check_arguments(table, batch, arguments, inputs.size());
  for (const fs::path& input : inputs) {
    Job job{fmt::format("{}-{}", command, stem_of(input)), command, input, {command, input.string()}};
    if (const int same = ++names[job.name]; same > 1) job.name += fmt::format("-{}", same);
    job.arguments.insert(job.arguments.end(), arguments.begin(), arguments.end());
    const auto outputs = outputs_of(command, batch.output / job.name);
    job.arguments.insert(job.arguments.end(), outputs.begin(), outputs.end());
    job.arguments.emplace_back("--json");
    batch.jobs.push_back(std::move(job));
  }
  table.finish();
}

}  // namespace

Batch read_batch(const fs::path& file) {
  TableReader root = TableReader::from_file(file);
  root.expect_format("diastole-batch", 1);
  Batch batch{fs::absolute(file).lexically_normal(), {}, {}};
  batch.output = batch.file.parent_path() / root.text("output");
  std::map<std::string, int> names;
  for (TableReader& table : root.tables("job"))
    add_jobs(batch, table, names);
  if (batch.jobs.empty()) root.fail("job", "there is no job", "Add a [[job]] with command and inputs.");
  root.finish();
  return batch;
}

}  // namespace diastole::batch
