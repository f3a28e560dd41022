#include "estimator/materials/reinforced_law.hpp"

#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "protocol/contract/angle.hpp"

namespace diastole {
namespace {

using Tensor = SymmetricTensor<double>;
using Values = std::span<const double>;

constexpr size_t own_parameters = 3;

/// What the added fibres do at one C.
struct Fibres {
  Fibres(const Tensor& c, Values values)
      : k1(values[0]),
        k2(values[1]),
        cosine(std::cos(rad_per_deg * values[2])),
        sine(std::sin(rad_per_deg * values[2])) {
    stretch = cosine * cosine * c[0] + sine * sine * c[1] + 2.0 * cosine * sine * c[3] - 1.0;
    growth = std::exp(k2 * stretch * stretch);
  }

  /// dI4/dC.
  [[nodiscard]] Tensor direction() const {
    return {cosine * cosine, sine * sine, 0.0, cosine * sine, 0.0, 0.0};
  }
  /// By the angle, in radians.
  [[nodiscard]] Tensor turn() const {
    const double twice = 2.0 * cosine * sine;
    return {-twice, twice, 0.0, cosine * cosine - sine * sine, 0.0, 0.0};
  }
  [[nodiscard]] double energy() const {
    const double square = stretch * stretch;
    return 0.5 * k1 * (k2 * square != 0.0 ? std::expm1(k2 * square) / k2 : square);
  }
  /// S = tension a a.
  [[nodiscard]] double tension() const { return 2.0 * k1 * stretch * growth; }
  /// dS/dE = stiffness a a a a.
  [[nodiscard]] double stiffness() const { return 4.0 * k1 * growth * (1.0 + 2.0 * k2 * stretch * stretch); }
  [[nodiscard]] double stretch_by_angle(const Tensor& c) const {
    const Tensor by = turn();
    return by[0] * c[0] + by[1] * c[1] + 2.0 * by[3] * c[3];
  }

  double k1, k2, cosine, sine;
  double stretch;  ///< I4 - 1
  double growth;
};

void add(Tensor& to, double factor, const Tensor& what) {
  for (size_t i = 0; i < to.size(); ++i)
    to[i] += factor * what[i];
}

class ReinforcedLaw final : public Law {
 public:
  explicit ReinforcedLaw(const Law& base)
      : base_(base),
        name_("reinforced-" + std::string(base.name())),
        parameters_(base.parameters().begin(), base.parameters().end()) {
    parameters_.push_back({"added_k1_kPa", "added fibres: stress for I4 - 1", -1e3, 3.0, "kPa"});
    parameters_.push_back({"added_k2", "stiffening of the added fibres with (I4 - 1)^2", -1.0, 5.0});
    parameters_.push_back(
        {"added_angle_deg", "of the added fibres, from the first material axis", -1e3, 15.0, "deg"});
  }

  std::string_view name() const override { return name_; }
  bool needs_axes() const override { return true; }
  std::span<const LawParameter> parameters() const override { return parameters_; }

  double energy(const Tensor& c, Values values) const override {
    return base_.energy(c, bases(values)) + Fibres(c, own(values)).energy();
  }
  Tensor stress(const Tensor& c, Values values) const override {
    Tensor stress = base_.stress(c, bases(values));
    const Fibres fibres(c, own(values));
    add(stress, fibres.tension(), fibres.direction());
    return stress;
  }
  MaterialResponse response(const Tensor& c, Values values) const override {
    return with_fibres(base_.response(c, bases(values)), c, values);
  }
  Tensor stress_sensitivity(const Tensor& c, Values values, size_t parameter) const override {
    if (parameter < base_.parameters().size()) return base_.stress_sensitivity(c, bases(values), parameter);
    return by_own(c, values, parameter);
  }
  MaterialResponse dual_response(const Tensor& c, Values values) const override {
    return with_fibres(base_.dual_response(c, bases(values)), c, values);
  }
  Tensor dual_stress_sensitivity(const Tensor& c, Values values, size_t parameter) const override {
    if (parameter < base_.parameters().size())
      return base_.dual_stress_sensitivity(c, bases(values), parameter);
    return by_own(c, values, parameter);
  }

 private:
  static Values bases(Values values) { return values.first(values.size() - own_parameters); }
  static Values own(Values values) { return values.last(own_parameters); }

  static MaterialResponse with_fibres(MaterialResponse response, const Tensor& c, Values values) {
    const Fibres fibres(c, own(values));
    const Tensor direction = fibres.direction();
    add(response.stress, fibres.tension(), direction);
    const Eigen::Map<const Eigen::Vector<double, 6>> a(direction.data());
    response.tangent += fibres.stiffness() * a * a.transpose();
    return response;
  }
  [[nodiscard]] Tensor by_own(const Tensor& c, Values values, size_t parameter) const {
    const Fibres fibres(c, own(values));
    Tensor slope{};
    switch (parameter - base_.parameters().size()) {
      case 0:
        add(slope, 2.0 * fibres.stretch * fibres.growth, fibres.direction());
        break;
      case 1:
        add(slope, fibres.tension() * fibres.stretch * fibres.stretch, fibres.direction());
        break;
      default:
        add(slope, 0.5 * rad_per_deg * fibres.stiffness() * fibres.stretch_by_angle(c), fibres.direction());
        add(slope, rad_per_deg * fibres.tension(), fibres.turn());
    }
    return slope;
  }

  const Law& base_;
  std::string name_;
  std::vector<LawParameter> parameters_;
};

}  // namespace

const Law& reinforced(const Law& base) {
  static std::mutex guard;
  static std::map<const Law*, std::unique_ptr<const ReinforcedLaw>> laws;
  const std::lock_guard lock(guard);
  std::unique_ptr<const ReinforcedLaw>& law = laws[&base];
  if (!law) law = std::make_unique<const ReinforcedLaw>(base);
  return *law;
}

}  // namespace diastole
