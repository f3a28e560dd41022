#pragma once
// C1 from a rotational shear test: Eq. 1 of Augenstein et al. (2005), fitted by linear least squares.
//
// Energy C1 (I1 - 3), so the shear modulus is 2 C1. Circles stay circles of the same radius and turn by
// omega(R); the shear is R omega'(R), its stress 2 C1 R omega'. The moment M through every cylinder of radius R
// and height h is the same: 2 pi h R^2 * 2 C1 R omega' = M. With omega(a) = 0 at the fixed inner radius a
//
//   omega(R) = M (a^-2 - R^-2) / (8 pi h C1)
//
// at any size of omega (free end faces matter from the second order of the shear on). Eq. 1 as printed,
//
//   (omega / F) C1 = A (a^-2 - R^-2) / (4 pi h),
//
// is the same if M = 2 F A: its factor is right, F is the force of *each* of the two parallel strings, and A is
// the strings' arm. The outer radius of the gel does not appear otherwise. With the force of both strings as F the
// printed form gives twice the true C1.
//
// The fitted line is  omega/M = (1/C1) (a^-2 - R^-2)/(8 pi h), through the origin, its errors in the measured
// rotation. The slope of the swapped axes (right side over left side, C1 itself, as the paper plots it) puts the
// errors in the regressor and comes out low by exactly the factor r2 of the
// normalised form; it is reported as `swapped_C1_kPa`.

#include <array>
#include <span>
#include <string>
#include <vector>

#include "estimator/shear/shear_test.hpp"

namespace diastole {

enum class ShearForm {
  normalised,  ///< rotation per moment, every row the same weight: the paper's
  rotation     ///< the rotation itself: right if every rotation is measured with the same error
};

struct ShearPoint {
  double rotation_per_moment_rad_per_Nm;  ///< omega / M
  double shape_1000_per_m3;               ///< (a^-2 - R^-2)/(8 pi h); C1 in kPa is this over omega/M
  double residual_deg;                    ///< measured rotation minus the fitted line's
};

/// What the rows of one load say by themselves.
struct ShearLoad {
  double moment_Nmm;
  size_t rows;
  double C1_kPa;
  double se_kPa;  ///< NaN for a single row
  double rms_deg;
};

struct ShearOutlier {
  size_t line;
  double residual_deg;
  double deviations;  ///< residual over its standard error, the row itself left out (Student's t)
};

struct ShearFit {
  bool determined = false;  ///< the interval of 1/C1 holds only positive values
  double C1_kPa = 0;
  double se_kPa = 0;
  std::array<double, 2> ci95_kPa = {};  ///< Student's t on 1/C1; infinite above if not determined
  double r2 = 0;  ///< uncentred, 1 - SSE / sum of squares about zero, as for a line through the origin
  double r2_about_mean = 0;  ///< 1 - SSE / sum of squares about the mean
  double swapped_C1_kPa = 0;
  double dof = 0;
  double rms_deg = 0;
  double largest_shear = 0;  ///< of the fitted solution, at the inner cylinder
  std::vector<ShearPoint> points;
  std::vector<ShearLoad> loads;  ///< by rising moment
  std::vector<ShearOutlier> outliers;
  std::vector<std::string> remarks;
};

/// `test` as read_shear_test gives it. Outliers are reported, not left out.
ShearFit fit_shear(const ShearTest& test, ShearForm form = ShearForm::normalised);

// A straight line through the origin, y = slope * x, by least squares.

struct OriginLine {
  double slope;
  double se;      ///< NaN for a single point
  double sum_xx;  ///< sum of x^2
  double sum_yy;  ///< sum of y^2
  double sum_of_residuals2;
  double dof;  ///< points - 1
};

/// At least one x is not zero; x and y are of one length.
OriginLine line_through_origin(std::span<const double> x, std::span<const double> y);

/// The intercept of the straight line with a free intercept over its standard error: Student's t with n - 2
/// degrees of freedom if the true line passes through the origin. NaN if all x are equal or n < 3.
double intercept_deviations(std::span<const double> x, std::span<const double> y);

}  // namespace diastole
