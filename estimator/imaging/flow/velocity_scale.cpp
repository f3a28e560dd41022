#include "estimator/imaging/flow/velocity_scale.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "protocol/contract/input_error.hpp"
#include "protocol/signal/quantile.hpp"

namespace diastole::imaging {
namespace {

/// So many of an image's pixels at least are air if a scale can be read from it.
constexpr double dark_share = 0.02;
/// The mean of a cycle's noise differs from pixel to pixel by a sixth or less: no pixel of noise is so much brighter than another.
constexpr double noise_spread = 1.5;
/// Of so many values evenly spread over an interval, the largest lies within a hundredth of its end but for one time in 10^4.
constexpr size_t least_air_pixels = 1000;
/// The mean of |x| over an even spread is half the end, with a standard error below 0.01 for that many.
constexpr double evenness = 0.04;
/// Rounding to the stored steps, and what a scanner's own background correction shifts.
constexpr double agreement = 0.05;

/// cm/s of one unit; nothing if the values are parts of a full scale.
std::optional<double> cm_s_per_unit(const ImageHeader& header) {
  if (header.rescale_units == "cm/s") return 1.0;
  if (header.rescale_units == "mm/s") return 0.1;
  if (header.rescale_units == "m/s") return 100.0;
  const bool bare = header.intercept == 0 && header.slope == 1;
  if (header.vendor == "GE" && bare) return 0.1;
  return std::nullopt;
}

}  // namespace

std::optional<double> full_scale_in_air(const std::vector<Image>& velocity,
                                        const std::vector<Image>& magnitude) {
  Image mean = Image::Zero(magnitude[0].rows(), magnitude[0].cols());
  for (const Image& image : magnitude)
    mean += image / static_cast<float>(magnitude.size());
  // The darkest pixels have noise alone; what rings from an edge is brighter.
  const float dark = signal::quantile(std::vector<float>(mean.data(), mean.data() + mean.size()), dark_share);
  const auto threshold = static_cast<float>(noise_spread) * dark;
  size_t count = 0, zeros = 0;
  double sum = 0, most = 0;
  for (const Image& image : velocity) {
    for (Eigen::Index i = 0; i < image.size(); ++i) {
      if (mean.data()[i] > threshold) continue;
      const auto value = static_cast<double>(std::abs(image.data()[i]));
      ++count;
      zeros += value == 0 ? 1U : 0U;
      sum += value;
      most = std::max(most, value);
    }
  }
  if (count < least_air_pixels || 10 * zeros > count) return std::nullopt;
  if (std::abs(sum / static_cast<double>(count) / most - 0.5) > evenness) return std::nullopt;
  return most;
}

VelocityScale velocity_scale(const ImageHeader& header, std::optional<double> full_scale,
                             std::optional<double> asked_cm_s, const std::string& file) {
  constexpr double half_turn = std::numbers::pi;
  const std::string tags =
      "(0018,9197), SequenceName (0018,0024), GE (0019,10cc), Philips (2001,101a), RescaleIntercept "
      "(0028,1052) in cm/s";
  const auto unit_cm_s = cm_s_per_unit(header);
  VelocityScale scale{};
  if (asked_cm_s) {
    scale = {0, *asked_cm_s, "--venc"};
  } else if (header.velocity) {
    scale = {0, header.velocity->venc_cm_s, header.velocity->source};
  } else if (unit_cm_s && full_scale) {
    // Stored in steps; the end of the scale is a round number of them.
    scale = {0, *full_scale * *unit_cm_s, "the noise in air, which fills the whole scale"};
  } else {
    throw InputError({file, tags, "the velocity encoding (venc) is absent",
                      "Give the protocol's venc in cm/s, for example --venc 100."});
  }
  if (unit_cm_s) {
    if (full_scale && std::abs(*full_scale * *unit_cm_s / scale.venc_cm_s - 1) > agreement)
      throw InputError(
          {file, scale.source,
           fmt::format("a venc of {:.4g} cm/s contradicts the pixels: noise in air fills the scale up to "
                       "{:.4g} cm/s",
                       scale.venc_cm_s, *full_scale * *unit_cm_s),
           fmt::format("If the values are not in {}, export the series again; otherwise give --venc {:.4g}.",
                       header.rescale_units.empty() ? "mm/s" : header.rescale_units,
                       *full_scale * *unit_cm_s)});
    scale.radians_per_unit = half_turn * *unit_cm_s / scale.venc_cm_s;
    return scale;
  }
  // Parts of a full scale: the intercept brings the stored 0 to its lower end.
  const std::optional<double> end = header.intercept < 0 ? std::optional(-header.intercept) : full_scale;
  if (!end)
    throw InputError({file, "(0028,1052), (0028,1053), (0028,1054)",
                      fmt::format("the values have no unit, and the intercept {:g} does not tell the scale",
                                  header.intercept),
                      "Export the series with its rescale slope, intercept and type."});
  if (full_scale && std::abs(*full_scale / *end - 1) > agreement)
    throw InputError(
        {file, "(0028,1052)",
         fmt::format("a full scale of {:.4g} contradicts the pixels: noise in air fills it up to {:.4g}",
                     *end, *full_scale),
         "Export the series again: slope or intercept belong to other images."});
  scale.radians_per_unit = half_turn / *end;
  return scale;
}

}  // namespace diastole::imaging
