#include "estimator/explain/rig/reference_file.hpp"

#include <fmt/format.h>

#include <system_error>

#include "estimator/explain/rig/reference_json.hpp"
#include "estimator/io/cache.hpp"
#include "estimator/io/study_fingerprint.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::explain {
namespace {

/// The rules by which references are learnt: another number makes what is in caches old.
constexpr int learning_version = 15;

std::string fingerprint_of(const std::vector<Study>& studies) {
  std::string all = std::to_string(learning_version);
  for (const Study& study : studies)
    all += "-" + study_fingerprint(study);
  return all;
}

}  // namespace

Reference reference_of(const Study& study, size_t threads,
                       const std::function<void(std::string_view)>& progress) {
  const auto& files = study.data.reference;
  const auto is_file = [](const std::filesystem::path& file) { return file.extension() == ".json"; };
  if (files.size() == 1 && is_file(files.front()))
    return reference_from_json(
        read_whole_file(files.front(), "Make it: `diastole reference STUDY... -o rig.reference.json`."),
        files.front().string());
  for (const std::filesystem::path& file : files) {
    if (is_file(file))
      throw InputError({.file = study.file.string(),
                        .place = "data.reference",
                        .problem = fmt::format("names {} beside other references", file.filename().string()),
                        .remedy = "Name one file made by `diastole reference`, or studies only."});
    if (std::error_code missing; std::filesystem::equivalent(file, study.file, missing))
      throw InputError({.file = study.file.string(),
                        .place = "data.reference",
                        .problem = "names the study itself",
                        .remedy = "Name sessions of the same rig in which nothing is wrong."});
  }
  std::vector<Study> studies;
  for (const std::filesystem::path& file : files)
    studies.push_back(read_study(file));
  const std::string fingerprint = fingerprint_of(studies);
  const std::string kept = fmt::format("reference-{}.json", fingerprint);
  if (const auto text = read_cached(kept)) {
    try {
      return reference_from_json(*text, kept);
    } catch (const InputError&) {  // not whole: learnt again
    }
  }
  Reference learnt = learn_reference(studies, threads, progress);
  learnt.fingerprint = fingerprint;
  write_cached(kept, to_json(learnt));
  return learnt;
}

}  // namespace diastole::explain
