#pragma once
// What a velocity image's values mean. A scanner stores the phase difference of two images, of which half a turn is the
// velocity encoding (venc); by maker it is in cm/s, in mm/s, or in parts of the full scale.

#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/dicom/dicom_file.hpp"

namespace diastole::imaging {

struct VelocityScale {
  double radians_per_unit;  ///< of a value after slope and intercept
  double venc_cm_s;
  std::string source;  ///< where the venc was read
};

/// In air the phase is noise, which fills half a turn to either side evenly: the largest value of half a turn. Nothing if there are fewer than
/// some hundred pixels of air, or if they are not filled evenly (masked by the scanner).
std::optional<double> full_scale_in_air(const std::vector<Image>& velocity,
                                        const std::vector<Image>& magnitude);

/// `asked_cm_s`: the user's venc, before what the headers say. `file` names the series in messages. Throws InputError if the venc stands nowhere,
/// or if headers and the noise in air contradict each other.
VelocityScale velocity_scale(const ImageHeader& header, std::optional<double> full_scale,
                             std::optional<double> asked_cm_s, const std::string& file);

}  // namespace diastole::imaging
