// A session as an RO-Crate: what the specification asks of the metadata, and that it says what the files hold.

#include <gmock/gmock.h>

#include <filesystem>
#include <fstream>
#include <map>

#include "host/runfile/ro_crate.hpp"
#include "protocol/runfile/reader.hpp"
#include "tests/host/bench/scratch.hpp"

namespace diastole {
namespace {

using nlohmann::ordered_json;

/// Every {"@id": ...} that an entity refers to.
void references(const ordered_json& value, std::vector<std::string>& found) {
  if (value.is_object() && value.size() == 1 && value.contains("@id")) found.push_back(value["@id"]);
  if (value.is_structured())
    for (const auto& member : value)
      references(member, found);
}

TEST(RoCrate, IsFlatLinkedAndSaysWhatTheFilesHold) {
  const Scratch scratch("crate");
  const std::filesystem::path source = DIASTOLE_SOURCE_DIR;
  std::filesystem::copy_file(source / "examples/recorded-baseline.run.h5", scratch / "gel.run.h5");
  std::ofstream(scratch / "gel.experiment.toml") << "abc";
  std::ofstream(scratch / "gel.fit.json") << "{}";
  CratedRun run{"gel.run.h5", "gel.experiment.toml", runfile::read_run(scratch / "gel.run.h5"), {}};
  run.run.rig["fluid_density_kg_m3"] = 1005.0;
  run.run.rig["hose_creep_fraction"] = 0.05;
  run.session.facts = {
      {"specimen", std::string("gel 7")}, {"operator", std::string("Jo")}, {"room_temperature_C", 21.5}};
  run.session.notes = {{"2026-11-23T14:00:00Z", "Ann", "a bubble"}};
  const ordered_json crate = ro_crate({.title = "A session",
                                       .published_utc = "2026-11-23T15:00:00Z",
                                       .license = "https://spdx.org/licenses/CC-BY-4.0",
                                       .runs = {run},
                                       .others = {{"gel.fit.json", "a fit"}, {"dicom/", "images"}}},
                                      scratch.path());
  EXPECT_EQ(crate["@context"], "https://w3id.org/ro/crate/1.1/context");
  std::map<std::string, ordered_json> entities;
  for (const auto& entity : crate["@graph"]) {
    EXPECT_TRUE(entity.contains("@type")) << entity;
    EXPECT_TRUE(entities.emplace(entity["@id"], entity).second) << entity["@id"] << " is there twice";
    for (const auto& [key, value] : entity.items())
      EXPECT_FALSE(value.is_object() && value.size() > 1)
          << entity["@id"] << " " << key << ": entities are not nested";
  }
  EXPECT_EQ(entities["ro-crate-metadata.json"]["conformsTo"]["@id"], "https://w3id.org/ro/crate/1.1");
  for (const char* key : {"name", "description", "datePublished", "license"})
    EXPECT_TRUE(entities["./"].contains(key)) << key;
  std::vector<std::string> linked;
  references(crate["@graph"], linked);
  for (const std::string& id : linked)
    EXPECT_TRUE(entities.contains(id) || id.starts_with("https://") || id == "./") << id << " leads nowhere";
  // sha256 of "abc" is an example of FIPS 180-4.
  EXPECT_EQ(entities["gel.experiment.toml"]["sha256"],
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(entities["gel.experiment.toml"]["contentSize"], "3");
  EXPECT_EQ(entities["gel.run.h5"]["about"]["@id"], "#specimen-gel%207");
  EXPECT_EQ(entities["#specimen-gel%207"]["name"], "gel 7");
  EXPECT_EQ(entities["#acquisition-gel.run.h5"]["agent"]["@id"], "#person-Jo");
  EXPECT_EQ(entities["#note-gel.run.h5-1"]["author"]["@id"], "#person-Ann");
  EXPECT_EQ(entities["#rig-gel.run.h5-room_temperature_C"]["value"], 21.5);
  EXPECT_EQ(entities["#rig-gel.run.h5-room_temperature_C"]["unitText"], "degC");
  EXPECT_EQ(entities["#rig-gel.run.h5-hose_length_m"]["unitText"], "m");
  EXPECT_EQ(entities["#rig-gel.run.h5-fluid_density_kg_m3"]["unitText"], "kg/m3");
  EXPECT_FALSE(entities["#rig-gel.run.h5-hose_creep_fraction"].contains("unitText"));
  EXPECT_EQ(entities["dicom/"]["@type"], "Dataset");
}

}  // namespace
}  // namespace diastole
