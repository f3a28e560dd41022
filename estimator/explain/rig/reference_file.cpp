#include "estimator/explain/rig/reference_file.hpp"

#include <fmt/format.h>

#include <system_error>

#include "estimator/io/cache.hpp"
#include "estimator/io/record_file.hpp"
#include "estimator/io/study_fingerprint.hpp"
#include "estimator/io/termination_json.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;

/// The rules by which references are learnt: another number makes what is in caches old.
constexpr int learning_version = 15;

constexpr RecordFormat format{
    "diastole-reference", "a reference of a rig",
    "Make one of sessions in which nothing is wrong: `diastole reference STUDY... -o "
    "rig.reference.json`."};

std::vector<double> list_of(const Eigen::VectorXd& values) {
  return {values.data(), values.data() + values.size()};
}

Eigen::VectorXd vector_of(const Json& json) {
  const auto values = json.get<std::vector<double>>();
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Index>(values.size()));
}

std::string fingerprint_of(const std::vector<Study>& studies) {
  std::string all = std::to_string(learning_version);
  for (const Study& study : studies)
    all += "-" + study_fingerprint(study);
  return all;
}

}  // namespace

std::string to_json(const Reference& reference) {
  Json json;
  Json& channels = json["channels"] = Json::object();
  for (size_t s = 0; s < rig::signal_count; ++s) {
    if (reference.rms[s] == 0.0) continue;
    Json& channel = channels[std::string(rig::name_of(static_cast<rig::Signal>(s)))];
    if (static_cast<rig::Signal>(s) == rig::Signal::volume) {
      channel["rms_mL"] = reference.rms[s];
    } else {
      channel["rms_Pa"] = 1e3 * reference.rms[s];
    }
    channel["percent_of_range"] = reference.percent_of_range[s];
  }
  json["fingerprint"] = reference.fingerprint;
  json["sessions"] = reference.sessions;
  json["termination"] = written(reference.termination);
  json["rig"] = {{"hose_length_m", reference.hose_length_m}, {"hose_bore_mm", reference.hose_bore_mm}};
  json["shares"] = {{"all", reference.all}, {"again", reference.again}};
  json["tolerances"] = {{"names", reference.tolerances},
                        {"mean", list_of(reference.mean)},
                        {"covariance", list_of(reference.covariance.reshaped())}};
  Json& segments = json["segments"] = Json::object();
  for (const auto& [key, segment] : reference.segments)
    segments[key] = {{"misfit", list_of(segment.misfit)}, {"noise", list_of(segment.noise)}};
  return json_text(format.document(json)) + "\n";
}

Reference reference_from_json(std::string_view text, const std::string& file) {
  Reference reference;
  format.read(text, file, [&](const Json& json) {
    for (size_t s = 0; s < rig::signal_count; ++s) {
      const std::string name(rig::name_of(static_cast<rig::Signal>(s)));
      const Json& channels = json.at("channels");
      if (!channels.contains(name)) continue;
      const Json& channel = channels.at(name);
      reference.rms[s] = channel.contains("rms_mL") ? channel.at("rms_mL").get<double>()
                                                    : 1e-3 * channel.at("rms_Pa").get<double>();
      reference.percent_of_range[s] = channel.at("percent_of_range").get<double>();
    }
    reference.fingerprint = json.at("fingerprint").get<std::string>();
    reference.sessions = json.at("sessions").get<size_t>();
    if (json.contains("termination")) read_json(json.at("termination"), reference.termination);
    if (json.contains("rig")) {
      reference.hose_length_m = json.at("rig").at("hose_length_m").get<double>();
      reference.hose_bore_mm = json.at("rig").at("hose_bore_mm").get<double>();
    }
    reference.all = json.at("shares").at("all").get<rig::Shares>();
    reference.again = json.at("shares").at("again").get<rig::Shares>();
    const Json& tolerances = json.at("tolerances");
    reference.tolerances = tolerances.at("names").get<std::vector<std::string>>();
    reference.mean = vector_of(tolerances.at("mean"));
    const Eigen::VectorXd covariance = vector_of(tolerances.at("covariance"));
    const auto count = static_cast<Index>(reference.tolerances.size());
    if (reference.mean.size() != count || covariance.size() != count * count)
      throw std::invalid_argument("key tolerances: the lists differ in length");
    reference.covariance = covariance.reshaped(count, count);
    if (reference.covariance.llt().info() != Eigen::Success)
      throw std::invalid_argument("key tolerances.covariance: is no covariance");
    for (const auto& [key, segment] : json.at("segments").items()) {
      ReferenceSegment& read = reference.segments[key];
      read.misfit = vector_of(segment.at("misfit"));
      read.noise = vector_of(segment.at("noise"));
      if (read.misfit.size() != read.noise.size())
        throw std::invalid_argument(fmt::format("key segments: the lists of \"{}\" differ in length", key));
    }
  });
  return reference;
}

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
