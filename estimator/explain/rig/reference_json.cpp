#include "estimator/explain/rig/reference_json.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <span>
#include <utility>

#include "estimator/io/record_file.hpp"
#include "estimator/io/termination_json.hpp"
#include "protocol/contract/json_text.hpp"

namespace diastole::explain {
namespace {

using Eigen::Index;
template <class Value>
using Named = std::vector<std::pair<std::string, Value>>;

constexpr RecordFormat format{
    "diastole-reference", "a reference of a rig",
    "Make one of sessions in which nothing is wrong: `diastole reference STUDY... -o "
    "rig.reference.json`."};

// The file's layout.

struct ChannelMisfit {
  std::optional<double> rms_mL = {}, rms_Pa = {};
  double percent_of_range = 0.0;
};
template <class Visit, IsRecord<ChannelMisfit> Record>
void each_member(Visit&& visit, Record& channel) {
  visit("rms_mL", if_any(channel.rms_mL));
  visit("rms_Pa", if_any(channel.rms_Pa));
  visit("percent_of_range", channel.percent_of_range);
}

struct DeclaredHose {
  double hose_length_m = 0.0, hose_bore_mm = 0.0;
};
DIASTOLE_MEMBERS(DeclaredHose, hose_length_m, hose_bore_mm)

struct ErrorShares {
  rig::Shares all{}, again{};
};
DIASTOLE_MEMBERS(ErrorShares, all, again)

struct LearntTolerances {
  std::vector<std::string> names;
  std::vector<double> mean, covariance;
};
DIASTOLE_MEMBERS(LearntTolerances, names, mean, covariance)

struct SegmentMisfit {
  std::vector<double> misfit, noise;
};
DIASTOLE_MEMBERS(SegmentMisfit, misfit, noise)

struct Document {
  Named<ChannelMisfit> channels = {};
  std::string fingerprint;
  size_t sessions = 0;
  inference::Termination termination = inference::Termination::no_solution;
  std::optional<DeclaredHose> rig;
  ErrorShares shares;
  LearntTolerances tolerances;
  Named<SegmentMisfit> segments = {};
};
template <class Visit, IsRecord<Document> Record>
void each_member(Visit&& visit, Record& document) {
  visit("channels", by_name(document.channels));
  DIASTOLE_VISIT(visit, document, fingerprint, sessions, termination)
  visit("rig", if_any(document.rig));
  DIASTOLE_VISIT(visit, document, shares, tolerances)
  visit("segments", by_name(document.segments));
}

std::vector<double> list_of(const Eigen::VectorXd& values) {
  return {values.data(), values.data() + values.size()};
}

/// Throws MemberFault for what the file has as null.
void require_number(double value, const std::string& member) {
  if (!std::isfinite(value)) throw MemberFault("is no number", member);
}

void require_numbers(std::span<const double> values, const std::string& member) {
  for (size_t i = 0; i < values.size(); ++i)
    if (!std::isfinite(values[i])) throw MemberFault("is no number", fmt::format("{}[{}]", member, i));
}

Eigen::VectorXd vector_of(const std::vector<double>& values, const std::string& member) {
  require_numbers(values, member);
  return Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Index>(values.size()));
}

void take_tolerances(const LearntTolerances& learnt, Reference& reference) {
  reference.tolerances = learnt.names;
  reference.mean = vector_of(learnt.mean, "tolerances.mean");
  const Eigen::VectorXd covariance = vector_of(learnt.covariance, "tolerances.covariance");
  const auto count = static_cast<Index>(learnt.names.size());
  if (reference.mean.size() != count || covariance.size() != count * count)
    throw MemberFault(fmt::format("has {} names, {} means and {} covariances", count, reference.mean.size(),
                                  covariance.size()),
                      "tolerances");
  reference.covariance = covariance.reshaped(count, count);
  if (reference.covariance.llt().info() != Eigen::Success)
    throw MemberFault("is no covariance", "tolerances.covariance");
}

void take_channel(const std::string& name, const ChannelMisfit& channel, Reference& reference) {
  size_t signal = 0;
  while (signal < rig::signal_count && rig::name_of(static_cast<rig::Signal>(signal)) != name)
    ++signal;
  if (signal == rig::signal_count) return;  // of a later version
  const std::string member = "channels." + name;
  if (!channel.rms_mL && !channel.rms_Pa) throw MemberFault("has neither rms_mL nor rms_Pa", member);
  const double rms = channel.rms_mL ? *channel.rms_mL : 1e-3 * *channel.rms_Pa;
  require_number(rms, member + (channel.rms_mL ? ".rms_mL" : ".rms_Pa"));
  require_number(channel.percent_of_range, member + ".percent_of_range");
  reference.rms[signal] = rms;
  reference.percent_of_range[signal] = channel.percent_of_range;
}

Reference reference_in(const Document& document) {
  Reference reference;
  for (const auto& [name, channel] : document.channels)
    take_channel(name, channel, reference);
  reference.fingerprint = document.fingerprint;
  reference.sessions = document.sessions;
  reference.termination = document.termination;
  const DeclaredHose hose = document.rig.value_or(DeclaredHose{});
  require_number(hose.hose_length_m, "rig.hose_length_m");
  require_number(hose.hose_bore_mm, "rig.hose_bore_mm");
  reference.hose_length_m = hose.hose_length_m;
  reference.hose_bore_mm = hose.hose_bore_mm;
  require_numbers(document.shares.all, "shares.all");
  require_numbers(document.shares.again, "shares.again");
  reference.all = document.shares.all;
  reference.again = document.shares.again;
  take_tolerances(document.tolerances, reference);
  for (const auto& [key, segment] : document.segments) {
    const std::string member = "segments." + key;
    if (segment.misfit.size() != segment.noise.size())
      throw MemberFault(
          fmt::format("has {} misfits and {} noises", segment.misfit.size(), segment.noise.size()), member);
    reference.segments[key] = {vector_of(segment.misfit, member + ".misfit"),
                               vector_of(segment.noise, member + ".noise")};
  }
  return reference;
}

}  // namespace

std::string to_json(const Reference& reference) {
  Document document{.fingerprint = reference.fingerprint,
                    .sessions = reference.sessions,
                    .termination = reference.termination,
                    .rig = DeclaredHose{reference.hose_length_m, reference.hose_bore_mm},
                    .shares = {reference.all, reference.again},
                    .tolerances = {reference.tolerances, list_of(reference.mean),
                                   list_of(reference.covariance.reshaped())}};
  for (size_t s = 0; s < rig::signal_count; ++s) {
    if (reference.rms[s] == 0.0) continue;
    const auto signal = static_cast<rig::Signal>(s);
    ChannelMisfit channel{.percent_of_range = reference.percent_of_range[s]};
    if (signal == rig::Signal::volume)
      channel.rms_mL = reference.rms[s];
    else
      channel.rms_Pa = 1e3 * reference.rms[s];
    document.channels.emplace_back(rig::name_of(signal), channel);
  }
  for (const auto& [key, segment] : reference.segments)
    document.segments.emplace_back(key, SegmentMisfit{list_of(segment.misfit), list_of(segment.noise)});
  return json_text(format.document(written(document))) + "\n";
}

Reference reference_from_json(std::string_view text, const std::string& file) {
  Document document;
  Reference reference;
  format.read(text, file, [&](const Json& json) {
    read_json(json, document);
    reference = reference_in(document);
  });
  return reference;
}

}  // namespace diastole::explain
