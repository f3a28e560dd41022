#include "host/runfile/ro_crate.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <fstream>
#include <set>

#include "protocol/contract/input_error.hpp"
#include "protocol/runfile/layout.hpp"
#include "protocol/wire/sha256.hpp"

namespace diastole {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

Json id(const std::string& of) { return {{"@id", of}}; }

std::string sha256_of(const fs::path& file) {
  std::ifstream stream(file, std::ios::binary);
  wire::Sha256 hash;
  std::array<char, 1U << 16> block{};
  while (stream.read(block.data(), block.size()), stream.gcount() > 0)
    hash.add({reinterpret_cast<const uint8_t*>(block.data()), static_cast<size_t>(stream.gcount())});
  if (stream.bad() || !fs::is_regular_file(file))
    throw InputError({file.string(), "", "cannot be read", "Check the file and that you may read it."});
  return fmt::format("{:02x}", fmt::join(hash.digest(), ""));
}

Json file_entity(const fs::path& folder, const std::string& name, const std::string& encoding,
                 const std::string& description) {
  return {{"@id", name},
          {"@type", "File"},
          {"name", description},
          {"encodingFormat", encoding},
          {"contentSize", fmt::format("{}", fs::file_size(folder / name))},
          {"sha256", sha256_of(folder / name)}};
}

std::string encoding_of(const std::string& name) {
  static const std::map<std::string, std::string> known{
      {".h5", "application/x-hdf5"}, {".json", "application/json"}, {".csv", "text/csv"},
      {".toml", "application/toml"}, {".html", "text/html"},        {".gz", "application/gzip"},
      {".dcm", "application/dicom"}};
  const auto found = known.find(fs::path(name).extension().string());
  return found == known.end() ? "application/octet-stream" : found->second;
}

/// Attributes as PropertyValues; "hose_length_m" has the unit m.
Json properties(const std::map<std::string, runfile::Attribute, std::less<>>& attributes) {
  Json list = Json::array();
  for (const auto& [name, value] : attributes) {
    Json property{{"@type", "PropertyValue"}, {"name", name}};
    std::visit([&](const auto& v) { property["value"] = v; }, value);
    if (const std::string unit(runfile::unit_of(name));
        unit != "1" && !std::holds_alternative<std::string>(value))
      property["unitText"] = unit;
    list.push_back(property);
  }
  return list;
}

class Graph {
 public:
  void add(Json entity) {
    if (ids_.insert(entity.at("@id")).second) list_.push_back(std::move(entity));
  }
  [[nodiscard]] Json take() { return std::move(list_); }

 private:
  std::set<std::string> ids_;
  Json list_ = Json::array();
};

/// "#specimen-gel%207": an identifier's characters that an address cannot hold are written as their bytes.
std::string anchor(const std::string& kind, const std::string& name) {
  std::string text = "#" + kind + "-";
  for (const char c : name) {
    const bool plain = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') ||
                       c == '-' || c == '_' || c == '.';
    text += plain ? std::string(1, c) : fmt::format("%{:02X}", static_cast<unsigned char>(c));
  }
  return text;
}

void add_run(Graph& graph, Json& mentions, const CratedRun& crated, const fs::path& folder) {
  const runfile::RecordedRun& run = crated.run;
  const std::string specimen = crated.session.text(runfile::specimen_fact),
                    person = crated.session.text(runfile::operator_fact);
  Json file = file_entity(folder, crated.name, "application/x-hdf5", "Run " + run.run_id);
  file["identifier"] = run.run_id;
  file["dateCreated"] = run.started_utc;
  file["variableMeasured"] = Json::array();
  for (const auto& [channel, values] : run.pressure.channels) {
    const Json measured{{"@id", anchor("channel", channel)},
                        {"@type", "PropertyValue"},
                        {"name", "/pressure/" + channel},
                        {"unitText", "kPa"}};
    file["variableMeasured"].push_back(id(measured.at("@id")));
    graph.add(measured);
  }
  if (!specimen.empty()) file["about"] = id(anchor("specimen", specimen));
  Json action{
      {"@id", anchor("acquisition", crated.name)},
      {"@type", "CreateAction"},
      {"name", "Acquisition of " + crated.name},
      {"startTime", run.started_utc},
      {"instrument", Json::array({id(anchor("software", run.producer)), id(anchor("rig", crated.name))})},
      {"object", id(crated.experiment)},
      {"result", id(crated.name)}};
  if (!person.empty()) action["agent"] = id(anchor("person", person));
  Json comments = Json::array();
  for (size_t i = 0; i < crated.session.notes.size(); ++i) {
    const runfile::SessionNote& note = crated.session.notes[i];
    Json comment{{"@id", fmt::format("{}-{}", anchor("note", crated.name), i + 1)},
                 {"@type", "Comment"},
                 {"text", note.text},
                 {"dateCreated", note.written_utc}};
    if (!note.author.empty()) {
      comment["author"] = id(anchor("person", note.author));
      graph.add({{"@id", anchor("person", note.author)}, {"@type", "Person"}, {"name", note.author}});
    }
    comments.push_back(id(comment.at("@id")));
    graph.add(comment);
  }
  if (!comments.empty()) file["comment"] = comments;
  mentions.push_back(id(action.at("@id")));
  graph.add(file);
  graph.add(file_entity(folder, crated.experiment, "application/toml", "The experiment as it was run"));
  graph.add(action);
  if (!person.empty()) graph.add({{"@id", anchor("person", person)}, {"@type", "Person"}, {"name", person}});
  if (!specimen.empty())
    graph.add({{"@id", anchor("specimen", specimen)}, {"@type", "Thing"}, {"name", specimen}});
  graph.add(
      {{"@id", anchor("software", run.producer)}, {"@type", "SoftwareApplication"}, {"name", run.producer}});
  Json rig = properties(run.rig);
  if (const auto room_C = crated.session.number(runfile::room_temperature_fact))
    rig.push_back({{"@type", "PropertyValue"},
                   {"name", runfile::room_temperature_fact},
                   {"value", *room_C},
                   {"unitText", runfile::unit_of(runfile::room_temperature_fact)}});
  // A crate's entities are flat: each property is one of its own.
  Json of_rig = Json::array();
  for (Json& property : rig) {
    property["@id"] = anchor("rig", crated.name) + "-" + property.at("name").get<std::string>();
    of_rig.push_back(id(property.at("@id")));
    graph.add(property);
  }
  graph.add({{"@id", anchor("rig", crated.name)},
             {"@type", "IndividualProduct"},
             {"name", "The rig of " + crated.name},
             {"additionalProperty", of_rig}});
}

}  // namespace

Json ro_crate(const Crate& crate, const fs::path& folder) {
  Graph graph;
  Json parts = Json::array(), mentions = Json::array();
  graph.add({{"@id", "ro-crate-metadata.json"},
             {"@type", "CreativeWork"},
             {"conformsTo", id("https://w3id.org/ro/crate/1.1")},
             {"about", id("./")}});
  for (const CratedRun& run : crate.runs) {
    add_run(graph, mentions, run, folder);
    parts.push_back(id(run.name));
    parts.push_back(id(run.experiment));
  }
  for (const CratedFile& other : crate.others) {
    parts.push_back(id(other.name));
    graph.add(other.name.ends_with('/')
                  ? Json{{"@id", other.name}, {"@type", "Dataset"}, {"name", other.description}}
                  : file_entity(folder, other.name, encoding_of(other.name), other.description));
  }
  Json root{
      {"@id", "./"},
      {"@type", "Dataset"},
      {"name", crate.title},
      {"description", "A session of Diastole: a pump inflates a soft specimen, its pressure is recorded."},
      {"datePublished", crate.published_utc},
      {"hasPart", parts},
      {"mentions", mentions}};
  if (crate.license) root["license"] = id(*crate.license);
  graph.add(root);
  return {{"@context", "https://w3id.org/ro/crate/1.1/context"}, {"@graph", graph.take()}};
}

}  // namespace diastole
