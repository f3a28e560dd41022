#include "estimator/imaging/tracking/tag_tracker.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <random>

#include "estimator/imaging/series/spectrum.hpp"
#include "estimator/imaging/tracking/brightness.hpp"
#include "estimator/imaging/tracking/ghost_phase.hpp"
#include "estimator/imaging/tracking/joint_motion.hpp"
#include "estimator/imaging/tracking/robust_weight.hpp"
#include "protocol/signal/median.hpp"

namespace diastole::imaging {
namespace {

constexpr double two_pi = 2 * std::numbers::pi;

/// Tags sample the motion once a spacing, and so resolve waves of two spacings and longer: half of them is one.
constexpr double knots_in_spacings = 2.0;
/// Brightness varies over a tag spacing, not within it: there it is the tags' own.
constexpr double window_in_spacings = 1.0;
/// A pixel counts as surely tissue this far inside: a pixel's half width and the point spread of a matrix that is half filled.
constexpr double sure_in_pixels = 1.25;
/// Before anything is learnt: motion from phase to phase of a fifth of a spacing, alike over some spacings.
constexpr double first_step_in_spacings = 0.2;
constexpr double first_range_in_spacings = 4.0;
/// Ranges to choose from by evidence: kappa = 1 / (these times the spacing).
constexpr std::array ranges_in_spacings = {4.0, 16.0};
/// A motion that begins at rest has done 2 (2 t / T)^2 of its whole after a small t: a thousandth after a hundredth of the cycle.
constexpr double late_share = 0.02;
constexpr double settled_mm = 0.005;
/// A person sets a point on a line to half a pixel.
constexpr double seen_in_pixels = 0.5;
/// How far around a place that a person saw the start of a search may be led: ranges to choose from, in spacings.
constexpr std::array led_ranges_in_spacings = {1.0, 2.0, 4.0};

double robust_sigma(const std::vector<double>& residuals) {
  std::vector<double> sizes;
  for (const double residual : residuals)
    sizes.push_back(std::abs(residual));
  return sizes.empty() ? 0 : signal::deviation_of_normal(std::move(sizes));
}

struct Pixel {
  Eigen::Index row, column;
  Eigen::Vector2d x_mm;
  SplineValues splines;
};

/// The motion at a place where a person saw a tag.
struct SeenMotion {
  SplineValues splines;
  double w_mm;
};

class ViewTracker {
 public:
  explicit ViewTracker(const TagView& view)
      : view_(view), waves_(view.waves), model_(view.waves.size()), spacing_mm_(view.waves[0].spacing_mm()) {}

  TrackedView track(std::optional<TrackingFault>& fault) {
    MaterialMap first = first_materials(view_);
    if (!view_.edits.empty()) draw_contours(view_.edits[0], first);
    settle_waves(first);
    if (!collect_pixels(first)) {
      fault = TrackingFault{
          "no tissue was found: nothing whose tags fade within a cycle and that is two spacings wide"};
      return {};
    }
    follow(first);
    fit_all_phases();
    return result();
  }

 private:
  [[nodiscard]] size_t directions() const { return waves_.size(); }
  [[nodiscard]] size_t times() const { return view_.images.size(); }
  [[nodiscard]] double sure_mm() const {
    return sure_in_pixels * std::max(view_.plane.row_spacing_mm, view_.plane.column_spacing_mm);
  }

  void rest_phases(const Eigen::Vector2d& x_mm, std::span<double> phases) const {
    for (size_t f = 0; f < directions(); ++f)
      phases[f] = waves_[f].phase_rad(x_mm);
  }

  /// Corrects wave vectors and offsets by tissue in the first phase; if that comes late, by still water in all phases too.
  void settle_waves(const MaterialMap& map) {
    const Eigen::ArrayXXf water = depth_mm(map, Material::still_water, view_.plane);
    const Eigen::ArrayXXf tissue = depth_mm(map, Material::tissue, view_.plane);
    const bool is_late = view_.times_ms.front() > late_share * view_.times_ms.back();
    for (int round = 0; round < 3; ++round) {
      std::vector<Eigen::Matrix3d> matrix(directions(), Eigen::Matrix3d::Zero());
      std::vector<Eigen::Vector3d> vector(directions(), Eigen::Vector3d::Zero());
      for (size_t k = 0; k < times(); ++k) {
        if (is_late) add_waves(k, water, 2.5 * sure_mm(), matrix, vector);
        if (k == 0) add_waves(k, tissue, 1.5 * sure_mm(), matrix, vector);
      }
      for (size_t f = 0; f < directions(); ++f) {
        const Eigen::Vector3d step = matrix[f].ldlt().solve(vector[f]);
        if (!step.allFinite()) continue;
        const Eigen::Vector2d middle = 0.5 * view_.extent_mm();
        waves_[f].per_mm += step.head<2>() / view_.extent_mm().norm();
        waves_[f].offset_cycles += step.head<2>().dot(middle) / view_.extent_mm().norm() - step[2];
      }
      rest_matrices_ = matrix;
    }
    spacing_mm_ = waves_[0].spacing_mm();
  }

  void add_waves(size_t k, const Eigen::ArrayXXf& depth, double least_mm,
                 std::vector<Eigen::Matrix3d>& matrix, std::vector<Eigen::Vector3d>& vector) const {
    const Image& image = view_.images[k];
    Brightness brightness(view_.extent_mm(), window_in_spacings * spacing_mm_,
                          static_cast<int>(model_.patterns()));
    struct Sample {
      Eigen::Vector2d x_mm;
      std::array<double, 2> phases;
      TagPatterns patterns;
      double value;
    };
    std::vector<Sample> samples;
    for (Eigen::Index column = 0; column < image.cols(); ++column) {
      for (Eigen::Index row = 0; row < image.rows(); ++row) {
        if (static_cast<double>(depth(row, column)) < least_mm || view_.is_masked(k, row, column)) continue;
        Sample sample{view_.place_mm(row, column), {}, {}, static_cast<double>(image(row, column))};
        rest_phases(sample.x_mm, sample.phases);
        sample.patterns = model_.at(sample.phases);
        brightness.add(sample.x_mm, sample.patterns.values(), 1.0, sample.value);
        samples.push_back(sample);
      }
    }
    if (samples.size() < 100) return;
    brightness.solve(Brightness::Places::added);
    std::vector<double> residuals;
    std::vector<std::array<double, TagPatterns::most>> amplitudes(samples.size());
    for (size_t i = 0; i < samples.size(); ++i)
      residuals.push_back(samples[i].value -
                          picture(brightness, samples[i].x_mm, samples[i].patterns, amplitudes[i]));
    const double sigma = std::max(robust_sigma(residuals), 1e-9);
    const Eigen::Vector2d middle = 0.5 * view_.extent_mm();
    for (size_t i = 0; i < samples.size(); ++i) {
      const double weight = huber_weight(residuals[i], sigma) / (sigma * sigma);
      for (size_t f = 0; f < directions(); ++f) {
        const double slope = two_pi * model_.slope(samples[i].phases, samples[i].patterns, amplitudes[i], f);
        Eigen::Vector3d row;
        row << slope * (samples[i].x_mm - middle) / view_.extent_mm().norm(), slope;
        matrix[f] += weight * row * row.transpose();
        vector[f] += weight * residuals[i] * row;
      }
    }
  }

  static double picture(const Brightness& brightness, const Eigen::Vector2d& x_mm,
                        const TagPatterns& patterns, std::array<double, TagPatterns::most>& amplitudes) {
    brightness.at(x_mm, std::span(amplitudes).first(patterns.count));
    double sum = 0;
    for (size_t j = 0; j < patterns.count; ++j)
      sum += amplitudes[j] * patterns.value[j];
    return sum;
  }

  /// All pixels that tissue may reach in the cycle: half a spacing around the first map and more, and what is within drawn contours.
  bool collect_pixels(const MaterialMap& map) {
    const Eigen::ArrayXXf depth = depth_mm(map, Material::tissue, view_.plane);
    const auto is_drawn = [&](Eigen::Index row, Eigen::Index column) {
      return std::any_of(view_.edits.begin(), view_.edits.end(), [&](const PhaseEdits& edits) {
        return edits.within_outer && (*edits.within_outer)(row, column);
      });
    };
    std::vector<Eigen::Vector2d> places;
    for (Eigen::Index column = 0; column < map.cols(); ++column) {
      for (Eigen::Index row = 0; row < map.rows(); ++row) {
        if (static_cast<double>(depth(row, column)) < -0.75 * spacing_mm_ && !is_drawn(row, column)) continue;
        pixels_.push_back({row, column, view_.place_mm(row, column), {}});
        places.push_back(pixels_.back().x_mm);
      }
    }
    if ((map == Material::tissue).count() < 200) return false;
    Eigen::Matrix2Xd samples(2, static_cast<Eigen::Index>(places.size()));
    for (size_t i = 0; i < places.size(); ++i)
      samples.col(static_cast<Eigen::Index>(i)) = places[i];
    splines_.emplace(samples, knots_in_spacings * spacing_mm_);
    for (Pixel& pixel : pixels_)
      pixel.splines = splines_->at(pixel.x_mm);
    coefficients_.assign(directions(),
                         Eigen::MatrixXd::Zero(splines_->count(), static_cast<Eigen::Index>(times())));
    phases_.resize(times());
    collect_seen();
    return true;
  }

  void collect_seen() {
    seen_.assign(times(), std::vector<std::vector<SeenMotion>>(directions()));
    for (size_t k = 0; k < view_.edits.size(); ++k) {
      for (const SeenTag& seen : view_.edits[k].seen) {
        const TagWave& wave = waves_[static_cast<size_t>(seen.direction)];
        const double d_mm = (seen.tag + wave.offset_cycles) * wave.spacing_mm();
        seen_[k][static_cast<size_t>(seen.direction)].push_back(
            {splines_->at(seen.x_mm), d_mm - wave.per_mm.normalized().dot(seen.x_mm)});
      }
    }
  }

  [[nodiscard]] bool is_led(size_t k) const {
    return std::any_of(seen_[k].begin(), seen_[k].end(), [](const auto& seen) { return !seen.empty(); });
  }

  /// What a person saw, as information on the coefficients.
  [[nodiscard]] PhaseInformation information_of(const std::vector<SeenMotion>& all) const {
    const double sigma_mm = seen_in_pixels * view_.plane.finer_spacing_mm();
    PhaseInformationSum sum(splines_->count());
    for (const SeenMotion& seen : all)
      sum.add(seen.splines, 1 / (sigma_mm * sigma_mm), seen.w_mm / (sigma_mm * sigma_mm));
    return sum.take();
  }

  void tracked_phases(const Pixel& pixel, size_t k, std::span<double> phases) const {
    rest_phases(pixel.x_mm, phases);
    for (size_t f = 0; f < directions(); ++f)
      phases[f] += two_pi * waves_[f].per_mm.norm() *
                   spline_sum(pixel.splines, coefficients_[f].col(static_cast<Eigen::Index>(k)));
  }

  void find_edges(size_t k, const RestPatterns& rest) {
    PatternMaps tissue = rest.fixed;
    std::array<double, 2> phases{};
    for (const Pixel& pixel : pixels_) {
      tracked_phases(pixel, k, phases);
      const TagPatterns patterns = model_.at(std::span(phases).first(directions()));
      for (size_t i = 0; i < patterns.count; ++i)
        tissue[i](pixel.row, pixel.column) = patterns.value[i];
    }
    const TrackedPhase& before = phases_[k];
    set_materials(k, refined_materials(k, view_, before.materials, before.depth_mm, tissue, rest));
  }

  void set_materials(size_t k, MaterialMap map) {
    if (!view_.edits.empty()) draw_contours(view_.edits[k], map);
    phases_[k].materials = std::move(map);
    phases_[k].depth_mm = depth_mm(phases_[k].materials, Material::tissue, view_.plane);
  }

  /// Phase after phase: motion, edge, motion.
  void follow(const MaterialMap& first) {
    first_precision_ = splines_->precision(1.0 / (first_range_in_spacings * spacing_mm_));
    const RestPatterns rest(view_, waves_);
    for (size_t k = 0; k < times(); ++k) {
      const auto time = static_cast<Eigen::Index>(k);
      for (Eigen::MatrixXd& each : coefficients_) {
        if (k == 1) each.col(time) = each.col(0);
        // Half of the last step goes on: motion turns within a cycle.
        if (k >= 2) each.col(time) = each.col(time - 1) + 0.5 * (each.col(time - 1) - each.col(time - 2));
      }
      const std::vector<Eigen::MatrixXd> expected = coefficients_;
      if (k == 0 || !view_.edits.empty()) {
        set_materials(k, k == 0 ? first : phases_[k - 1].materials);
      } else {
        phases_[k].materials = phases_[k - 1].materials;
        phases_[k].depth_mm = phases_[k - 1].depth_mm;
      }
      if (is_led(k)) {
        lead(k, expected);
      } else {
        fit_phase(k, view_.images[k], expected, 2);
      }
      find_edges(k, rest);
      if (k == 0) find_edges(k, rest);
      fit_phase(k, view_.images[k], is_led(k) ? coefficients_ : expected, 4);
      if (is_led(k)) put_right_before(k, rest);
    }
  }

  /// Searches once more from starts that go through what a person saw, and less and less far around it; keeps the end that explains
  /// image, person and expectation best. A line that jumped to the next stripe fits its own surroundings as well as the right one, and
  /// no search leads out of there.
  void lead(size_t k, const std::vector<Eigen::MatrixXd>& expected) {
    const auto time = static_cast<Eigen::Index>(k);
    const double step_mm = first_step_in_spacings * spacing_mm_;
    std::vector<Eigen::MatrixXd> best;
    double least = 0, noise = 0;
    for (const double range : led_ranges_in_spacings) {
      const Eigen::MatrixXd prior = splines_->precision(1.0 / (range * spacing_mm_)) / (step_mm * step_mm);
      coefficients_ = expected;
      for (size_t f = 0; f < directions(); ++f) {
        const PhaseInformation seen = information_of(seen_[k][f]);
        coefficients_[f].col(time) =
            (seen.precision + prior).ldlt().solve(seen.vector + prior * expected[f].col(time));
      }
      const std::vector<Eigen::MatrixXd> start = coefficients_;
      fit_phase(k, view_.images[k], start, 4);
      explain(k);
      if (best.empty()) noise = phases_[k].noise;
      double cost = image_cost(noise) + step_cost(coefficients_, k, expected, k);
      for (size_t f = 0; f < directions(); ++f)
        cost += seen_cost(k, f);
      if (!best.empty() && cost >= least) continue;
      least = cost;
      best = coefficients_;
    }
    coefficients_ = std::move(best);
  }

  /// A line that a person puts right in phase k jumped there or in a phase before. Goes back from k, and takes what is found so from
  /// the phase on at which image and steps from phase to phase together cost least.
  void put_right_before(size_t k, const RestPatterns& rest) {
    const std::vector<Eigen::MatrixXd> right = coefficients_;
    std::vector<Eigen::MatrixXd> back = right;
    double gain = 0, most = 0;  // in cost, over no change
    size_t from = k;
    for (size_t j = k; j-- > 0 && !is_led(j);) {
      const auto time = static_cast<Eigen::Index>(j);
      coefficients_ = right;
      explain(j);
      const double noise = phases_[j].noise;
      const TrackedPhase before = phases_[j];
      const double cost = image_cost(noise) + step_cost(right, j, right, j + 1);
      coefficients_ = back;
      double apart_mm = 0;
      for (size_t f = 0; f < directions(); ++f) {
        coefficients_[f].col(time) = back[f].col(time + 1);
        if (j + 2 <= k) coefficients_[f].col(time) += 0.5 * (back[f].col(time + 1) - back[f].col(time + 2));
      }
      const std::vector<Eigen::MatrixXd> start = coefficients_;
      fit_phase(j, view_.images[j], start, 4);
      explain(j);
      back = coefficients_;
      for (size_t f = 0; f < directions(); ++f)
        apart_mm = std::max(apart_mm, (back[f].col(time) - right[f].col(time)).cwiseAbs().maxCoeff());
      gain += cost - image_cost(noise) - step_cost(back, j, back, j + 1);
      phases_[j] = before;
      // The step across which the two ways meet; before the first phase is rest.
      const std::vector<Eigen::MatrixXd> rested(directions(), Eigen::MatrixXd::Zero(splines_->count(), 1));
      const std::vector<Eigen::MatrixXd>& earlier = j == 0 ? rested : right;
      const size_t then = j == 0 ? 0 : j - 1;
      const double met = step_cost(earlier, then, right, j) - step_cost(earlier, then, back, j);
      if (gain + met > most) {
        most = gain + met;
        from = j;
      }
      if (apart_mm < first_step_in_spacings * spacing_mm_) break;
    }
    coefficients_ = right;
    for (size_t j = from; j < k; ++j) {
      for (size_t f = 0; f < directions(); ++f)
        coefficients_[f].col(static_cast<Eigen::Index>(j)) = back[f].col(static_cast<Eigen::Index>(j));
    }
    for (size_t j = from; j < k; ++j) {
      find_edges(j, rest);
      fit_phase(j, view_.images[j], coefficients_, 4);
    }
  }

  /// Minus the log likelihood of an image at the motion that it was explained with last, with Huber's loss.
  [[nodiscard]] double image_cost(double noise) const {
    double sum = 0;
    for (const Fitted& fitted : fitted_) {
      const double off = std::abs(fitted.residual) / noise;
      sum += off < huber_limit ? 0.5 * off * off : huber_limit * (off - 0.5 * huber_limit);
    }
    return sum;
  }

  /// Minus the log prior density of the step between two phases.
  [[nodiscard]] double step_cost(const std::vector<Eigen::MatrixXd>& a, size_t k_a,
                                 const std::vector<Eigen::MatrixXd>& b, size_t k_b) const {
    const double step_mm = first_step_in_spacings * spacing_mm_;
    double sum = 0;
    for (size_t f = 0; f < directions(); ++f) {
      const Eigen::VectorXd step =
          a[f].col(static_cast<Eigen::Index>(k_a)) - b[f].col(static_cast<Eigen::Index>(k_b));
      sum += 0.5 * step.dot(first_precision_ * step) / (step_mm * step_mm);
    }
    return sum;
  }

  [[nodiscard]] double seen_cost(size_t k, size_t f) const {
    const double sigma_mm = seen_in_pixels * view_.plane.finer_spacing_mm();
    double sum = 0;
    for (const SeenMotion& seen : seen_[k][f])
      sum += 0.5 * std::pow((spline_sum(seen.splines, coefficients_[f].col(static_cast<Eigen::Index>(k))) -
                             seen.w_mm) /
                                sigma_mm,
                            2);
    return sum;
  }

  void fit_phase(size_t k, const Image& image, const std::vector<Eigen::MatrixXd>& expected,
                 int most_rounds) {
    const auto time = static_cast<Eigen::Index>(k);
    const double step_mm = first_step_in_spacings * spacing_mm_;
    const Eigen::MatrixXd prior = first_precision_ / (step_mm * step_mm);
    for (int round = 0; round < most_rounds; ++round) {
      double largest = 0;
      for (size_t f = 0; f < directions(); ++f) {
        explain(k, image);
        PhaseInformation information = information_in(k, f);
        const Eigen::VectorXd now = coefficients_[f].col(time);
        if (!seen_[k][f].empty()) {
          const PhaseInformation seen = information_of(seen_[k][f]);
          information.precision += seen.precision;
          information.vector += seen.vector - seen.precision * now;
        }
        const Eigen::VectorXd step = (information.precision + prior)
                                         .llt()
                                         .solve(information.vector + prior * (expected[f].col(time) - now));
        coefficients_[f].col(time) += step;
        largest = std::max(largest, step.cwiseAbs().maxCoeff());
      }
      if (largest < settled_mm) break;
    }
  }

  /// Fits an image's brightness at the present motion. Residuals and slopes are kept.
  void explain(size_t k, const Image& image) {
    TrackedPhase& phase = phases_[k];
    Brightness brightness(view_.extent_mm(), window_in_spacings * spacing_mm_,
                          static_cast<int>(model_.patterns()));
    fitted_.clear();
    for (const Pixel& pixel : pixels_) {
      if (static_cast<double>(phase.depth_mm(pixel.row, pixel.column)) < sure_mm() ||
          view_.is_masked(k, pixel.row, pixel.column))
        continue;
      Fitted fitted{&pixel, {}, {}, 0, {}};
      tracked_phases(pixel, k, fitted.phases);
      fitted.patterns = model_.at(fitted.phases);
      brightness.add(pixel.x_mm, fitted.patterns.values(), 1.0,
                     static_cast<double>(image(pixel.row, pixel.column)));
      fitted_.push_back(fitted);
    }
    brightness.solve(Brightness::Places::added);
    std::vector<double> residuals;
    phase.residual.setZero(image.rows(), image.cols());
    phase.slope.assign(directions(), Eigen::ArrayXXf::Zero(image.rows(), image.cols()));
    std::array<double, TagPatterns::most> amplitudes{};
    for (Fitted& fitted : fitted_) {
      const Pixel& pixel = *fitted.pixel;
      fitted.residual = static_cast<double>(image(pixel.row, pixel.column)) -
                        picture(brightness, pixel.x_mm, fitted.patterns, amplitudes);
      residuals.push_back(fitted.residual);
      phase.residual(pixel.row, pixel.column) = static_cast<float>(fitted.residual);
      for (size_t f = 0; f < directions(); ++f) {
        fitted.slope[f] =
            two_pi * waves_[f].per_mm.norm() * model_.slope(fitted.phases, fitted.patterns, amplitudes, f);
        phase.slope[f](pixel.row, pixel.column) = static_cast<float>(fitted.slope[f]);
      }
    }
    phase.noise = std::max(robust_sigma(residuals), 1e-9);
    phase.pixels = fitted_.size();
  }

  void explain(size_t k) { explain(k, view_.images[k]); }

  /// Gradient (in place of eta) and curvature of one direction's motion in the image explained last, at the motion that it was explained with.
  [[nodiscard]] PhaseInformation information_in(size_t k, size_t f) const {
    const TrackedPhase& phase = phases_[k];
    PhaseInformationSum sum(splines_->count());
    for (const Fitted& fitted : fitted_) {
      const double beside_noise = excess_.over_phases(phase, fitted.pixel->row, fitted.pixel->column);
      const double weight =
          huber_weight(fitted.residual, phase.noise) / (phase.noise * phase.noise * beside_noise);
      sum.add(fitted.pixel->splines, weight * fitted.slope[f] * fitted.slope[f],
              weight * fitted.slope[f] * fitted.residual);
    }
    return sum.take();
  }

  /// A phase's residual power near the tags' frequency over that of white noise of the same variance, where there is nothing but noise: farther
  /// off than the motion can follow, and within two thirds of a cycle a spacing of the tags.
  double power_near_tags(const TrackedPhase& phase, size_t f) const {
    const Eigen::Vector2d extent(view_.plane.columns * view_.plane.column_spacing_mm,
                                 view_.plane.rows * view_.plane.row_spacing_mm);
    const auto limit = static_cast<float>(huber_limit * phase.noise);
    double pixels = 0;
    Image clean = Image::Zero(phase.residual.rows(), phase.residual.cols());
    for (Eigen::Index column = 0; column < clean.cols(); ++column) {
      for (Eigen::Index row = 0; row < clean.rows(); ++row) {
        if (phase.residual(row, column) == 0 || !excess_.is_clean(row, column)) continue;
        clean(row, column) = std::clamp(phase.residual(row, column), -limit, limit);
        pixels += 1;
      }
    }
    const Eigen::ArrayXXf power = spectrum_of(clean).abs2();
    double sum = 0, count = 0;
    for (Eigen::Index column = 0; column < power.cols(); ++column) {
      for (Eigen::Index row = 0; row < power.rows(); ++row) {
        const Eigen::Vector2d per_mm(signed_bin(column, power.cols()) / extent.x(),
                                     signed_bin(row, power.rows()) / extent.y());
        const double apart = (per_mm - waves_[f].per_mm).norm() * spacing_mm_;
        if (apart < 0.4 || apart > 0.65) continue;
        sum += static_cast<double>(power(row, column));
        count += 1;
      }
    }
    return sum / (std::max(count, 1.0) * std::max(pixels, 1.0) * phase.noise * phase.noise);
  }

  /// Noise power near the tags' frequency over the mean. A narrow wall blurs the spectrum, so that what the fit takes of the noise at the tags'
  /// frequency is missing beside it too: as much as it takes of white noise that is put in the residual's place.
  double noise_factor(size_t f) {
    double seen = 0, counted = 0;
    for (size_t k = 0; k < times(); ++k) {
      if (phases_[k].pixels == 0) continue;
      seen += power_near_tags(phases_[k], f);
      counted += 1;
    }
    std::mt19937 engine(20);
    double kept = 0, tried = 0;
    for (const size_t k : {size_t{0}, times() / 2, times() - 1}) {
      if (phases_[k].pixels == 0) continue;
      std::normal_distribution<float> white(0.0F, static_cast<float>(phases_[k].noise));
      const Image image = (view_.images[k] - phases_[k].residual).unaryExpr([&](float value) {
        return value + white(engine);
      });
      const TrackedPhase before = phases_[k];
      const std::vector<Eigen::MatrixXd> coefficients = coefficients_;
      fit_phase(k, image, coefficients, 2);
      explain(k, image);
      kept += power_near_tags(phases_[k], f);
      tried += 1;
      coefficients_ = coefficients;
      phases_[k] = before;
    }
    return std::clamp((seen / std::max(counted, 1.0)) / std::max(kept / std::max(tried, 1.0), 0.1), 0.2,
                      10.0);
  }

  void fit_all_phases() {
    excess_ = ResidualExcess(phases_, view_.plane, spacing_mm_);
    for (size_t f = 0; f < directions(); ++f)
      factors_.push_back(noise_factor(f));
    std::vector<double> kappas;
    for (const double range : ranges_in_spacings)
      kappas.push_back(1.0 / (range * spacing_mm_));
    // The prior is learnt from estimates phase by phase first, and then from its own.
    std::vector<MotionPrior> priors(directions());
    joint_.resize(directions());
    for (const bool last : {false, true}) {
      for (size_t f = 0; f < directions(); ++f) {
        const std::vector<PhaseInformation> found = informations(f);
        priors[f] = learn_motion_prior(*splines_, found, coefficients_[f], kappas);
        joint_[f] = fit_jointly(priors[f], found, last);
        coefficients_[f] = joint_[f].coefficients;
      }
    }
    kappa_per_mm_ = priors[0].kappa_per_mm;
    for (size_t k = 0; k < times(); ++k)
      explain(k);
  }

  std::vector<PhaseInformation> informations(size_t f) {
    std::vector<PhaseInformation> all;
    for (size_t k = 0; k < times(); ++k) {
      explain(k);
      PhaseInformation here = information_in(k, f);
      here.vector += here.precision * coefficients_[f].col(static_cast<Eigen::Index>(k));
      here.precision /= factors_[f];
      here.vector /= factors_[f];
      if (!seen_[k][f].empty()) {
        const PhaseInformation seen = information_of(seen_[k][f]);
        here.precision += seen.precision;
        here.vector += seen.vector;
      }
      all.push_back(std::move(here));
    }
    return all;
  }

  TrackedView result() {
    TrackedView tracked;
    tracked.waves = waves_;
    for (size_t f = 0; f < directions(); ++f)
      tracked.motion.push_back({*splines_, std::move(joint_[f].coefficients), std::move(joint_[f].covariance),
                                spacing_mm_ * spacing_mm_ * factors_[f] * rest_matrices_[f].inverse(),
                                0.5 * view_.extent_mm(), view_.extent_mm().norm()});
    tracked.phases = std::move(phases_);
    tracked.excess = std::move(excess_);
    tracked.noise_factor = factors_;
    tracked.kappa_per_mm = kappa_per_mm_;
    return tracked;
  }

  struct Fitted {
    const Pixel* pixel;
    std::array<double, 2> phases;
    TagPatterns patterns;
    double residual;
    std::array<double, 2> slope;  // a direction
  };

  const TagView& view_;
  std::vector<TagWave> waves_;
  TagModel model_;
  double spacing_mm_;
  std::vector<Eigen::Matrix3d> rest_matrices_;
  std::vector<Pixel> pixels_;
  std::optional<SplinePlane> splines_;
  Eigen::MatrixXd first_precision_;
  std::vector<Eigen::MatrixXd> coefficients_;  // a direction: n x T
  std::vector<TrackedPhase> phases_;
  ResidualExcess excess_;                                   // before all phases are fitted together: none
  std::vector<std::vector<std::vector<SeenMotion>>> seen_;  // a phase and direction
  std::vector<Fitted> fitted_;
  std::vector<double> factors_;
  double kappa_per_mm_ = 0;
  std::vector<JointMotion> joint_;
};

}  // namespace

TrackedView track_view(const TagView& view, std::optional<TrackingFault>& fault) {
  fault.reset();
  TrackedView tracked = ViewTracker(view).track(fault);
  if (fault) return tracked;
  std::vector<const MaterialMap*> maps;
  std::vector<double> noise;
  for (const TrackedPhase& phase : tracked.phases) {
    maps.push_back(&phase.materials);
    noise.push_back(phase.noise);
  }
  std::vector<Ghost> ghosts = find_ghosts(view, maps, noise);
  if (ghosts.empty()) return tracked;
  for (Ghost& ghost : ghosts)
    measure_in_phase(view, tracked, ghost);
  const TagView clean = without_ghosts(view, tracked, ghosts);
  tracked = ViewTracker(clean).track(fault);
  tracked.ghosts = std::move(ghosts);
  return tracked;
}

}  // namespace diastole::imaging
