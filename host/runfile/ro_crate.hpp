#pragma once
// A session as an RO-Crate (w3id.org/ro/crate/1.1): a folder of files with ro-crate-metadata.json, JSON-LD in which schema.org's
// terms say what each file is, and when, by whom and with what it was made.
//
//   ./                      Dataset: hasPart all files, mentions each acquisition
//   NAME.run.h5             File, sha256
//   NAME.experiment.toml    File: the experiment as it was run
//   #acquisition-NAME       CreateAction: object the experiment, result the run, instrument Diastole and the rig, agent the operator
//   #rig-NAME, #specimen-…  the rig with its properties, the specimen
//   #note-NAME-k            Comment: the run's notes

#include <filesystem>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "protocol/runfile/run.hpp"
#include "protocol/runfile/session.hpp"

namespace diastole {

struct CratedRun {
  std::string name;        ///< of the run file in the crate
  std::string experiment;  ///< of the experiment's file in the crate
  runfile::RecordedRun run;
  runfile::Session session;
};

/// A file or a folder that lies in the crate beside the runs.
struct CratedFile {
  std::string name;  ///< from the crate's folder; of a folder it ends in '/'
  std::string description;
};

struct Crate {
  std::string title;
  std::string published_utc;
  std::optional<std::string> license = {};  ///< address of its text
  std::vector<CratedRun> runs;
  std::vector<CratedFile> others;
};

/// The document for files that lie in `folder` already: their sizes and hashes are taken there. Throws InputError if one cannot be
/// read.
nlohmann::ordered_json ro_crate(const Crate& crate, const std::filesystem::path& folder);

}  // namespace diastole
