#pragma once
// A measured ventricle as the data of its page.

#include "estimator/imaging/geometry/ventricle_session.hpp"
#include "estimator/io/ventricle_record.hpp"

namespace diastole::imaging {

/// Sections lie in the long-axis slices, each turned into a half-plane through the axis, or without any at 0, 60 and 120 degrees.
VentricleRecord ventricle_record(const VentricleSession& session, const GuidePoints& guide);

}  // namespace diastole::imaging
