#pragma once
// What was tracked, made to be looked at.

#include "estimator/imaging/tracking/tracked_folder.hpp"
#include "estimator/io/tracking_file.hpp"

namespace diastole::imaging {

TrackingRecord tracking_record(const TrackedFolder& tracked, double seconds);

}  // namespace diastole::imaging
