#include "estimator/imaging/flow/phase_contrast.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "estimator/imaging/flow/velocity_scale.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole::imaging {
namespace {

/// With fewer a cycle's course cannot be recovered from its samples.
constexpr size_t least_phases = 6;
/// Times of a phase in two series: scanners write the measured interval of each.
constexpr double same_time_steps = 0.25;

[[noreturn]] void refuse(const std::string& file, std::string place, std::string problem,
                         std::string remedy) {
  throw InputError({file, std::move(place), std::move(problem), std::move(remedy)});
}

std::string numbers_of(const std::vector<const ImageSeries*>& series) {
  std::string text;
  for (const ImageSeries* one : series)
    text += fmt::format("{}{}", text.empty() ? "" : ", ", one->number);
  return text;
}

const ImageSeries& velocity_series(const ImageFolder& folder, const PhaseContrastRequest& request) {
  std::vector<const ImageSeries*> found;
  for (const ImageSeries& series : folder.series) {
    if (series.kind == SeriesKind::velocity && (!request.series || series.number == *request.series))
      found.push_back(&series);
  }
  const std::string name = folder.folder.string();
  if (found.empty() && request.series)
    refuse(name, fmt::format("--series {}", *request.series), "is no velocity series of this folder",
           "`diastole images` lists them.");
  if (found.empty())
    refuse(
        name, "", "holds no velocity series: no image has values on both sides of zero",
        "Export the phase-contrast series with its phase (or velocity) images; `diastole images` says what "
        "is there.");
  if (found.size() > 1)
    refuse(name, "", fmt::format("holds {} velocity series, numbers {}", found.size(), numbers_of(found)),
           "Choose the one that encodes flow through the slice, for example --series " +
               std::to_string(found[0]->number) + ".");
  return *found[0];
}

size_t chosen_slice(const ImageFolder& folder, const ImageSeries& series,
                    const PhaseContrastRequest& request) {
  if (!request.slice && series.slices.size() == 1) return 0;
  if (!request.slice)
    refuse(folder.folder.string(), fmt::format("series {}", series.number),
           fmt::format("has {} slices", series.slices.size()),
           "Choose the one that the tube crosses, for example --slice 1.");
  if (*request.slice < 1 || *request.slice > series.slices.size())
    refuse(folder.folder.string(), fmt::format("--slice {}", *request.slice),
           fmt::format("does not exist: series {} has {}", series.number, series.slices.size()),
           "Slices count from 1.");
  return *request.slice - 1;
}

/// Per velocity image the magnitude of the same place and time.
struct Magnitudes {
  int series = 0;
  std::vector<size_t> images;
  std::vector<double> lacking_ms;  ///< times without one
};

Magnitudes magnitudes_in(const ImageFolder& folder, int series, const SliceImages& slice,
                         const SliceImages& velocity, double step_ms) {
  const auto trigger_ms = [&](size_t image) { return *folder.images[image].header.trigger_ms; };
  Magnitudes found{series, {}, {}};
  for (const size_t wanted : velocity.images) {
    const auto same = std::find_if(slice.images.begin(), slice.images.end(), [&](size_t image) {
      return std::abs(trigger_ms(image) - trigger_ms(wanted)) <= same_time_steps * step_ms;
    });
    if (same != slice.images.end())
      found.images.push_back(*same);
    else
      found.lacking_ms.push_back(trigger_ms(wanted));
  }
  return found;
}

/// Of several the nearest by series number: scanners number what one scan makes in a row.
std::vector<size_t> magnitudes_for(const ImageFolder& folder, const ImageSeries& series,
                                   const SliceImages& velocity, double step_ms) {
  std::optional<Magnitudes> best;
  const auto is_better = [&](const Magnitudes& found) {
    if (found.images.empty()) return false;
    if (!best || found.lacking_ms.size() != best->lacking_ms.size())
      return !best || found.lacking_ms.size() < best->lacking_ms.size();
    return std::abs(found.series - series.number) < std::abs(best->series - series.number);
  };
  for (const ImageSeries& other : folder.series) {
    if (other.kind != SeriesKind::cine && other.kind != SeriesKind::tagged_cine) continue;
    for (const SliceImages& slice : other.slices) {
      if (!same_place(slice.plane, velocity.plane)) continue;
      Magnitudes found = magnitudes_in(folder, other.number, slice, velocity, step_ms);
      if (is_better(found)) best = std::move(found);
    }
  }
  if (!best)
    refuse(folder.folder.string(), fmt::format("series {}", series.number),
           fmt::format("has velocities, but no magnitude images of the same place and {} trigger times are "
                       "in the folder",
                       velocity.images.size()),
           "Export the magnitude series of the same scan too: partial volume and noise are read from it.");
  if (!best->lacking_ms.empty())
    refuse(folder.folder.string(), fmt::format("series {}", best->series),
           fmt::format("has no magnitude image at {:.0f} ms, where series {} has a velocity image",
                       fmt::join(best->lacking_ms, " ms, "), series.number),
           "Export the magnitude series again with all its phases.");
  return best->images;
}

void require_phases(const ImageFolder& folder, const ImageSeries& series, const SliceImages& slice,
                    bool bridge_gaps) {
  const std::string file = folder.file_name(slice.images[0]);
  if (slice.images.size() < least_phases)
    refuse((folder.folder / file).string(), "(0018,1060)",
           fmt::format("series {} has {} phases; a cycle's flow needs {}", series.number, slice.images.size(),
                       least_phases),
           "Export all phases of the gated series.");
  std::vector<bool> there(series.phases.times_ms.size());
  for (const size_t image : slice.images)
    if (const auto phase = series.phases.index_of(*folder.images[image].header.trigger_ms))
      there[*phase] = true;
  std::string missing;
  for (size_t k = 0; k < there.size(); ++k)
    if (!there[k])
      missing +=
          fmt::format("{}{} ({:.0f} ms)", missing.empty() ? "" : ", ", k + 1, series.phases.times_ms[k]);
  // At the ends of the cycle only the header knows.
  const auto announced = folder.images[slice.images[0]].header.phases_announced;
  if (missing.empty() && announced && *announced > static_cast<int>(slice.images.size()))
    missing = fmt::format("{} to {}, or as many before the first,", slice.images.size() + 1, *announced);
  if (!missing.empty() && !bridge_gaps)
    refuse((folder.folder / file).string(), "(0018,1060), (0018,1090)",
           fmt::format("phase {} of {} is missing", missing,
                       std::max<size_t>(there.size(), static_cast<size_t>(announced.value_or(0)))),
           "Export the series again; or --bridge-gaps goes across, with the larger error that this costs.");
}

/// What was asked for is taken, and said to differ where it does: a slip of a finger scales every flow.
void add_contradictions(PhaseContrast& scan, const PhaseContrastRequest& request, const ImageHeader& header,
                        std::optional<double> interval_ms) {
  constexpr double differs = 0.02;
  const auto add = [&](const char* id, std::string what, double number, const char* unit,
                       const char* remedy) {
    scan.findings.push_back({Severity::warning, id, std::move(what), scan.name, number, unit, remedy});
  };
  if (request.reverse)
    scan.findings.push_back({Severity::note, "reversed", "flow against the slice's normal counts as positive",
                             scan.name, -1, "", "--reverse asked for it."});
  if (request.venc_cm_s && header.velocity &&
      std::abs(scan.venc_cm_s / header.velocity->venc_cm_s - 1) > differs)
    add("venc-contradicted",
        fmt::format(
            "--venc {:g} contradicts the headers, which state {:g} cm/s: all flow is in proportion to it",
            scan.venc_cm_s, header.velocity->venc_cm_s),
        header.velocity->venc_cm_s, "cm/s", "Leave --venc away unless the headers are known to be wrong.");
  if (request.interval_s && interval_ms) {
    const double cycles = scan.interval_s / (1e-3 * *interval_ms);
    const double whole = std::max(1.0, std::round(cycles));
    if (std::abs(cycles / whole - 1) > differs)
      add("period-contradicted",
          fmt::format(
              "--period {:g} is {:.2f} of the headers' intervals of {:g} s, and no whole number of them",
              scan.interval_s, cycles, 1e-3 * *interval_ms),
          1e-3 * *interval_ms, "s", "Leave --period away unless the headers are known to be wrong.");
  }
  // Gating leaves out up to a tenth of a cycle; what lies further beyond the last image is a guess.
  const double unseen_s = scan.interval_s - (scan.time_s.back() - scan.time_s.front());
  const double step_s = (scan.time_s.back() - scan.time_s.front()) / static_cast<double>(scan.phases() - 1);
  if (unseen_s > 3.0 * step_s && unseen_s > 0.2 * scan.interval_s)
    add("cycle-not-seen",
        fmt::format("no image shows {:.2f} s of the cycle's {:.2f} s: the volume there is a guess", unseen_s,
                    scan.interval_s),
        unseen_s, "s", "Check the cycle's length (--period), or export all phases.");
}

}  // namespace

double PhaseContrast::cm_s_per_radian() const { return venc_cm_s / std::numbers::pi; }

PhaseContrast phase_contrast(const ImageFolder& folder, const PhaseContrastRequest& request) {
  const ImageSeries& series = velocity_series(folder, request);
  const size_t at = chosen_slice(folder, series, request);
  const SliceImages& slice = series.slices[at];
  require_phases(folder, series, slice, request.bridge_gaps);
  const std::vector<double>& times_ms = series.phases.times_ms;
  const double step_ms = (times_ms.back() - times_ms.front()) / static_cast<double>(times_ms.size() - 1);

  PhaseContrast scan;
  scan.name = fmt::format("series {}, slice {}", series.number, at + 1);
  scan.plane = slice.plane;
  for (const size_t image : slice.images)
    scan.time_s.push_back(1e-3 * *folder.images[image].header.trigger_ms);
  scan.magnitude = folder.pixels(magnitudes_for(folder, series, slice, step_ms));
  scan.phase_rad = folder.pixels(slice.images);
  const std::string file = (folder.folder / folder.file_name(slice.images[0])).string();
  const VelocityScale scale =
      velocity_scale(folder.images[slice.images[0]].header, full_scale_in_air(scan.phase_rad, scan.magnitude),
                     request.venc_cm_s, file);
  scan.venc_cm_s = scale.venc_cm_s;
  scan.venc_source = scale.source;
  for (Image& image : scan.phase_rad)
    image *= static_cast<float>(request.reverse ? -scale.radians_per_unit : scale.radians_per_unit);

  const double span_s = scan.time_s.back() - scan.time_s.front();
  if (request.interval_s) {
    scan.interval_s = *request.interval_s;
    scan.interval_source = "--period";
  } else if (series.interval_ms) {
    scan.interval_s = 1e-3 * *series.interval_ms;
    scan.interval_source = "NominalInterval (0018,1062)";
  } else {
    refuse(file, "(0018,1062)", "the cycle's length (NominalInterval) is absent",
           "Give the time after which the flow repeats in seconds, for example --period 1.2.");
  }
  if (!(span_s < scan.interval_s * (1 + 1e-6)))
    refuse(file, scan.interval_source,
           fmt::format("a cycle of {:.4g} s is shorter than the {:.4g} s from the first phase to the last",
                       scan.interval_s, span_s),
           "Give the time after which the flow repeats with --period; gated on every second R-wave it is two "
           "cycles.");
  add_contradictions(scan, request, folder.images[slice.images[0]].header, series.interval_ms);
  return scan;
}

}  // namespace diastole::imaging
