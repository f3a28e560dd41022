#include "tools/sim_scanner/moving_body.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <optional>
#include <tuple>
#include <utility>

#include "estimator/mesh/point_locator.hpp"

namespace diastole::scanner {
namespace {

constexpr double in_plane_mm = 1.25, through_plane_mm = 2.0;
constexpr double far_mm = 3.0;  // outside of the tissue, as far as it is computed
constexpr Eigen::Index seeds_apart = 6;
constexpr double bath_mm = 10.0;  // of water around the specimen

/// An outer face of an element: how far a place is beyond it, and what lies there.
struct Border {
  size_t direction, side;
  double length_mm;  // of the element across it
  Medium beyond;
};

std::vector<std::vector<Border>> borders_of(const HermiteMesh& mesh) {
  std::vector<std::vector<Border>> borders(mesh.element_count());
  const auto add = [&](const std::vector<ElementFace>& faces, Medium beyond) {
    for (const ElementFace& face : faces) {
      Xi low{0.5, 0.5, 0.5}, high = low;
      low[face.direction] = 0;
      high[face.direction] = 1;
      const double length_mm = (mesh.value(mesh.reference(), {face.element, high}) -
                                mesh.value(mesh.reference(), {face.element, low}))
                                   .norm();
      borders[face.element].push_back({face.direction, face.side, length_mm, beyond});
    }
  };
  add(mesh.faces().inner, Medium::cavity);
  add(mesh.faces().outer, Medium::bath);
  add(mesh.faces().bottom, Medium::nothing);
  add(mesh.faces().top, Medium::nothing);
  return borders;
}

/// Looks for places on the deformed body, each beside one that was found.
class BodyFinder {
 public:
  BodyFinder(const HermiteMesh& mesh, const NodeField& position_mm, double beyond_mm)
      : borders_(borders_of(mesh)) {
    double thinnest_mm = 1e300;
    for (const auto& of_element : borders_) {
      for (const Border& border : of_element)
        thinnest_mm = std::min(thinnest_mm, border.length_mm);
    }
    outside_xi_ = std::clamp(beyond_mm / thinnest_mm, 0.05, 0.5);
    locator_.emplace(mesh, position_mm, LocatorOptions{.outside_xi = outside_xi_, .tolerance_mm = 1e-6});
  }

  [[nodiscard]] std::optional<MaterialPoint> find(const Eigen::Vector3d& x_mm) const {
    const auto found = locator_->find(x_mm);
    return found ? std::optional(found->point) : std::nullopt;
  }
  [[nodiscard]] std::optional<MaterialPoint> find_beside(const Eigen::Vector3d& x_mm,
                                                         const MaterialPoint& neighbour) const {
    const auto found = locator_->find_beside(x_mm, neighbour);
    if (!found || leaves_inwards(found->point)) return find(x_mm);
    return found->overshoot_xi <= outside_xi_ ? std::optional(found->point) : std::nullopt;
  }
  /// How far outside of the tissue a point is (not less than -far_mm), and what is beyond it there.
  [[nodiscard]] std::pair<double, Medium> outside(const MaterialPoint& point) const {
    std::pair<double, Medium> most{-far_mm, Medium::nothing};
    for (const Border& border : borders_[point.element]) {
      const double xi = point.xi[border.direction];
      const double outside_mm = border.length_mm * (border.side == 1 ? xi - 1 : -xi);
      if (outside_mm > most.first) most = {std::min(outside_mm, far_mm), border.beyond};
    }
    return most;
  }

 private:
  /// Whether the point is in another element rather than outside of the body.
  [[nodiscard]] bool leaves_inwards(const MaterialPoint& point) const {
    for (size_t k = 0; k < 3; ++k) {
      for (const size_t side : {size_t{0}, size_t{1}}) {
        const bool leaves = side == 1 ? point.xi[k] > 1 : point.xi[k] < 0;
        const auto is_here = [&](const Border& border) {
          return border.direction == k && border.side == side;
        };
        if (leaves && std::none_of(borders_[point.element].begin(), borders_[point.element].end(), is_here))
          return true;
      }
    }
    return false;
  }

  std::vector<std::vector<Border>> borders_;
  double outside_xi_ = 0;
  std::optional<PointLocator> locator_;
};

}  // namespace

SliceOfBody::Bath::Bath(const HermiteMesh& mesh) {
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    const double* place = &mesh.reference()[dof_of(node, 0, 0)];
    radius_mm = std::max(radius_mm, std::hypot(place[0], place[1]) + bath_mm);
    low_mm = std::min(low_mm, place[2]);
    high_mm = std::max(high_mm, place[2]);
  }
  // An apex hangs in the water; a body as wide at its lower end as above stands on a plate.
  const bool hangs = std::none_of(mesh.faces().bottom.begin(), mesh.faces().bottom.end(),
                                  [](const ElementFace&) { return true; });
  if (hangs) low_mm -= bath_mm;
}

bool SliceOfBody::Bath::holds(const Eigen::Vector3d& x_mm, double beyond_ends_mm) const {
  return std::hypot(x_mm.x(), x_mm.y()) < radius_mm && x_mm.z() > low_mm - beyond_ends_mm &&
         x_mm.z() < high_mm + beyond_ends_mm;
}

Eigen::Vector3d SliceOfBody::place_mm(const Eigen::Vector3d& within_mm) const {
  return plane_.first_mm + within_mm.x() * plane_.along_row + within_mm.y() * plane_.along_column +
         within_mm.z() * plane_.normal();
}

template <class Visit>
void SliceOfBody::each_place(const Visit& visit) const {
  for (Eigen::Index k = 0; k < layers_; ++k) {
    for (Eigen::Index j = 0; j < across_; ++j) {
      for (Eigen::Index i = 0; i < across_; ++i)
        visit(Place{i, j, k});
    }
  }
}

template <class Visit>
void SliceOfBody::each_neighbour(const Place& of, const Visit& visit) const {
  for (size_t axis = 0; axis < 3; ++axis) {
    for (const Eigen::Index step : {-1, 1}) {
      Place at = of;
      at[axis] += step;
      if (at[axis] >= 0 && at[axis] < (axis == 2 ? layers_ : across_)) visit(at);
    }
  }
}

SliceOfBody::SliceOfBody(const HermiteMesh& mesh, const NodeField& position_mm, const ScanPlane& plane,
                         double extent_mm, double thickness_mm)
    : plane_(plane),
      bath_(mesh),
      across_(static_cast<Eigen::Index>(std::ceil(extent_mm / in_plane_mm)) + 2),
      layers_(static_cast<Eigen::Index>(std::ceil(2 * thickness_mm / through_plane_mm)) + 1),
      first_mm_(-in_plane_mm, -in_plane_mm, -thickness_mm),
      step_mm_(in_plane_mm, in_plane_mm, 2 * thickness_mm / static_cast<double>(layers_ - 1)),
      nodes_(static_cast<size_t>(across_ * across_ * layers_)) {
  const BodyFinder finder(mesh, position_mm, step_mm_.norm());
  const auto node_mm = [&](const Place& at) {
    return place_mm(first_mm_ +
                    step_mm_.cwiseProduct(Eigen::Vector3d(
                        static_cast<double>(at[0]), static_cast<double>(at[1]), static_cast<double>(at[2]))));
  };
  std::deque<std::pair<Place, MaterialPoint>> found;
  const auto take = [&](const Place& at, const std::optional<MaterialPoint>& point) {
    Node& node = nodes_[index(at)];
    node.tried = true;
    if (!point) return;
    node.known = true;
    node.X_mm = mesh.value(mesh.reference(), *point);
    std::tie(node.outside_mm, node.beyond) = finder.outside(*point);
    found.emplace_back(at, *point);
  };
  for (Node& node : nodes_)
    node.outside_mm = far_mm;
  each_place([&](const Place& at) {
    Node& node = nodes_[index(at)];
    // Tissue beside a plate is interpolated with what the motion would be beyond.
    if (!bath_.holds(node_mm(at), step_mm_.norm())) node.known = node.tried = true;
  });
  // A few places are looked for everywhere, all others beside those.
  each_place([&](const Place& at) {
    if (at[0] % seeds_apart == 0 && at[1] % seeds_apart == 0 && !nodes_[index(at)].tried)
      take(at, finder.find(node_mm(at)));
  });
  while (!found.empty()) {
    const auto [from, point] = found.front();
    found.pop_front();
    each_neighbour(from, [&, beside = point](const Place& at) {
      if (!nodes_[index(at)].tried) take(at, finder.find_beside(node_mm(at), beside));
    });
  }
  fill_unknown();
}

/// Places beyond what the mesh can be extrapolated to are what their nearest known neighbours are beyond.
void SliceOfBody::fill_unknown() {
  std::deque<Place> edge;
  each_place([&](const Place& at) {
    const Node& node = nodes_[index(at)];
    if (node.known && node.outside_mm > -far_mm && node.beyond != Medium::nothing) edge.push_back(at);
  });
  while (!edge.empty()) {
    const Place from = edge.front();
    edge.pop_front();
    each_neighbour(from, [&](const Place& at) {
      Node& to = nodes_[index(at)];
      if (to.known) return;
      to.known = true;
      to.X_mm = nodes_[index(from)].X_mm;
      to.beyond = nodes_[index(from)].beyond;
      edge.push_back(at);
    });
  }
}

Spot SliceOfBody::at(const Eigen::Vector3d& within_mm) const {
  if (!bath_.holds(place_mm(within_mm))) return {Medium::nothing, Eigen::Vector3d::Zero()};
  const Eigen::Vector3d place = (within_mm - first_mm_).cwiseQuotient(step_mm_);
  const auto cell = [](double value, Eigen::Index count) {
    return std::clamp<Eigen::Index>(static_cast<Eigen::Index>(std::floor(value)), 0, count - 2);
  };
  const Eigen::Index i = cell(place.x(), across_), j = cell(place.y(), across_), k = cell(place.z(), layers_);
  const double u = place.x() - static_cast<double>(i), v = place.y() - static_cast<double>(j),
               w = place.z() - static_cast<double>(k);
  Eigen::Vector3d X_mm = Eigen::Vector3d::Zero();
  double outside_mm = 0, nearest = 0;
  Medium beyond = Medium::nothing;
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Index a = corner & 1, b = (corner >> 1) & 1, c = corner >> 2;
    const double share = (a == 1 ? u : 1 - u) * (b == 1 ? v : 1 - v) * (c == 1 ? w : 1 - w);
    const Node& node = nodes_[index({i + a, j + b, k + c})];
    X_mm += share * node.X_mm;
    outside_mm += share * node.outside_mm;
    // What is beyond is known best from the corner that is farthest outside.
    const double weight = share * (node.outside_mm + far_mm);
    if (weight <= nearest) continue;
    nearest = weight;
    beyond = node.beyond;
  }
  return {outside_mm < 0 ? Medium::tissue : beyond, X_mm};
}

}  // namespace diastole::scanner
