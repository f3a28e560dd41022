#include "estimator/explain/verdict/explained_study.hpp"

#include <toml++/toml.h>

#include <algorithm>
#include <sstream>

namespace diastole::explain {
namespace {

void move_path(toml::node& node, const std::filesystem::path& from, const std::filesystem::path& to) {
  auto* text = node.as_string();
  if (text == nullptr) return;
  const auto there = std::filesystem::absolute(from / text->get()).lexically_normal();
  *text = there.lexically_relative(std::filesystem::absolute(to).lexically_normal()).string();
}

toml::table& subtable(toml::table& parent, std::string_view key) {
  if (parent[key].as_table() == nullptr) parent.insert_or_assign(key, toml::table{});
  return *parent[key].as_table();
}

toml::table starts_of(const FoundEffect& effect) {
  toml::table starts;
  for (const FoundParameter& parameter : effect.parameters)
    starts.insert_or_assign(parameter.name, toml::table{{"start", parameter.value}});
  return starts;
}

toml::array moments_of(const FoundEffect& effect) {
  toml::array moments;
  for (const FoundChangePoint& at : effect.change_points)
    moments.push_back(toml::table{{"run", at.run}, {"time_s", at.time_s}});
  return moments;
}

}  // namespace

std::string explained_study(const Study& study, const std::filesystem::path& folder,
                            const std::vector<FoundEffect>& effects,
                            const std::vector<ParameterShift>& starts) {
  toml::table root = toml::parse_file(study.file.string());
  const std::filesystem::path from = study.file.parent_path();
  if (toml::table* data = root["data"].as_table()) {
    for (const char* key : {"tags", "points", "frames", "images"})
      if (toml::node* path = data->get(key)) move_path(*path, from, folder);
    for (const char* key : {"runs", "reference"})
      if (toml::array* paths = (*data)[key].as_array())
        for (toml::node& path : *paths)
          move_path(path, from, folder);
  }
  if (toml::table* specimen = root["specimen"].as_table())
    for (const char* key : {"file", "mesh_file", "fibres"})
      if (toml::node* path = specimen->get(key)) move_path(*path, from, folder);
  if (toml::table* law = root["law"].as_table())
    if (toml::node* file = law->get("file")) move_path(*file, from, folder);
  for (const ParameterShift& shift : starts) {
    if (toml::table* parameter = root["law"]["parameters"][shift.name].as_table()) {
      parameter->insert_or_assign("start", shift.after);
      // Bounds that the study states hold for its fit alone: an explanation may have found a value beyond them.
      const auto lower = (*parameter)["bounds"][0].value<double>();
      const auto upper = (*parameter)["bounds"][1].value<double>();
      if (lower && upper)
        parameter->insert_or_assign(
            "bounds", toml::array{std::min(*lower, shift.after), std::max(*upper, shift.after)});
    }
  }
  toml::table& model = subtable(root, "model");
  if (!study.effect_files.empty()) {
    toml::array files;
    for (const std::filesystem::path& file : study.effect_files) {
      toml::value<std::string> text(std::filesystem::absolute(file).string());
      move_path(text, "/", folder);
      files.push_back(std::move(text));
    }
    model.insert_or_assign("effect_files", std::move(files));
  }
  toml::array ids;
  for (const FoundEffect& effect : effects) {
    ids.push_back(effect.id);
    subtable(model, "parameters").insert_or_assign(effect.id, starts_of(effect));
    if (!effect.change_points.empty())
      subtable(model, "moments").insert_or_assign(effect.id, moments_of(effect));
  }
  model.insert_or_assign("effects", std::move(ids));
  std::ostringstream text;
  text << root << '\n';
  return text.str();
}

}  // namespace diastole::explain
