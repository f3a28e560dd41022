#pragma once
// One slice of a phase-contrast cine: magnitude and phase of each image, and what half a turn means.

#include <optional>
#include <string>
#include <vector>

#include "estimator/imaging/series/image_folder.hpp"

namespace diastole::imaging {

struct PhaseContrastRequest {
  std::optional<double> venc_cm_s = {};   ///< instead of the headers'
  std::optional<int> series = {};         ///< SeriesNumber of the velocities, where there are several
  std::optional<size_t> slice = {};       ///< from 1, where the series has several
  std::optional<double> interval_s = {};  ///< after which the flow repeats, instead of the headers'
  bool bridge_gaps = false;               ///< go across phases that are missing
  bool reverse = false;                   ///< the slice's normal points out of the specimen
};

struct PhaseContrast {
  std::string name;  ///< "series 5, slice 1"
  SlicePlane plane;
  std::vector<double> time_s;  ///< after the trigger, increasing
  double interval_s = 0;       ///< the flow repeats after it
  std::string interval_source;
  double venc_cm_s = 0;
  std::string venc_source;
  std::vector<Image> magnitude;
  std::vector<Image>
      phase_rad;  ///< within half a turn; positive along the slice's normal, or against it if asked
  std::vector<Finding> findings;  ///< what is asked and what headers say differ

  [[nodiscard]] size_t phases() const { return time_s.size(); }
  [[nodiscard]] double cm_s_per_radian() const;
};

/// Throws InputError (file, tag, value, remedy) if there is no velocity series, no choice among several, no magnitude for it, no venc, no cycle, a
/// phase is missing, or there are fewer than six.
PhaseContrast phase_contrast(const ImageFolder& folder, const PhaseContrastRequest& request);

}  // namespace diastole::imaging
