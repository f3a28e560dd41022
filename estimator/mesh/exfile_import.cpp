#include "estimator/mesh/exfile_import.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <tuple>
#include <utility>

#include "estimator/mesh/exfile_lines.hpp"
#include "estimator/mesh/face_map.hpp"
#include "protocol/contract/angle.hpp"

namespace diastole {
namespace {

constexpr std::array<std::string_view, nodal_derivatives> ex_derivatives{
    "value", "d/ds1", "d/ds2", "d2/ds1ds2", "d/ds3", "d2/ds1ds3", "d2/ds2ds3", "d3/ds1ds2ds3"};
constexpr std::string_view tricubic = "c.Hermite*c.Hermite*c.Hermite";
constexpr double scale_slack = 1e-12;

// --- exnode -------------------------------------------------------------------------------------------------

/// One component's numbers at a node: for each version its value and derivatives.
struct NodeComponent {
  size_t start = 0;                 // index of its first number among the node's
  std::vector<size_t> derivatives;  // which derivative each number of a version is; the first is the value
  size_t versions = 1;
};
struct NodeHeader {
  std::vector<NodeComponent> coordinates;
  std::optional<size_t> fibre;  // index of the fibre angle's first number
  size_t numbers = 0;           // of a node
};
struct ExNode {
  std::shared_ptr<const NodeHeader> header;
  std::vector<double> numbers;
};

bool begins_field(const ExLine& line) {
  const size_t bracket = line.text.find(')');
  return bracket != std::string::npos && bracket > 0 && bracket < 4 &&
         std::all_of(line.text.begin(), line.text.begin() + static_cast<std::ptrdiff_t>(bracket),
                     [](char c) { return c >= '0' && c <= '9'; });
}
void require_cartesian(const ExLines& lines, const ExLine& field) {
  if (has(field, "rectangular cartesian") && lines.number_after(field, "#Components=") == 3) return;
  lines.fail(field, "is not a field of three rectangular Cartesian components",
             "Export the coordinates as rectangular cartesian x, y, z.");
}

NodeComponent node_component(const ExLines& lines, const ExLine& line) {
  NodeComponent component;
  component.start = lines.number_after(line, "Value index=", 1) - 1;
  const size_t count = lines.number_after(line, "#Derivatives=");
  component.derivatives = {0};
  const size_t open = line.text.find('(');
  if (open != std::string::npos) {
    std::string names = line.text.substr(open + 1, line.text.find(')') - open - 1);
    names += ',';
    for (size_t from = 0, comma; (comma = names.find(',', from)) != std::string::npos; from = comma + 1) {
      const auto known =
          std::find(ex_derivatives.begin(), ex_derivatives.end(), names.substr(from, comma - from));
      if (known == ex_derivatives.end())
        lines.fail(
            line, fmt::format("\"{}\" is no derivative that is known here", names.substr(from, comma - from)),
            "Use d/ds1, d/ds2, d2/ds1ds2, d/ds3, d2/ds1ds3, d2/ds2ds3, d3/ds1ds2ds3.");
      component.derivatives.push_back(static_cast<size_t>(known - ex_derivatives.begin()));
    }
  }
  if (component.derivatives.size() != count + 1) {
    lines.fail(line, fmt::format("names {} derivatives but says {}", component.derivatives.size() - 1, count),
               "Name each derivative once in the brackets.");
  }
  if (has(line, "#Versions=")) component.versions = lines.number_after(line, "#Versions=", 1);
  return component;
}

NodeHeader read_node_header(ExLines& lines, const ExLine& fields) {
  NodeHeader header;
  const size_t count = lines.number_after(fields, "#Fields=");
  for (size_t field = 0; field < count; ++field) {
    const ExLine& line = lines.take();
    if (!begins_field(line))
      lines.fail(line, "is no field", "Write each as \"1) coordinates, coordinate, ...\".");
    const bool coordinates = has(line, ", coordinate,");
    if (coordinates) require_cartesian(lines, line);
    const bool fibres = has(line, ", anatomical, fibre");
    const size_t components = lines.number_after(line, "#Components=");
    for (size_t i = 0; i < components; ++i) {
      const NodeComponent component = node_component(lines, lines.take());
      header.numbers =
          std::max(header.numbers, component.start + component.versions * component.derivatives.size());
      if (coordinates && header.coordinates.size() < 3) header.coordinates.push_back(component);
      if (fibres && i == 0) header.fibre = component.start;
    }
  }
  return header;
}

std::map<size_t, ExNode> read_nodes(const NamedText& file) {
  ExLines lines(file.text, file.file);
  std::map<size_t, ExNode> nodes;
  std::shared_ptr<const NodeHeader> header;
  while (!lines.at_end()) {
    const ExLine line = lines.take();
    if (has(line, "#Fields=")) {
      header = std::make_shared<const NodeHeader>(read_node_header(lines, line));
    } else if (line.text.starts_with("Node:")) {
      if (!header) lines.fail(line, "comes before any #Fields=", "Give the fields' header first.");
      const size_t number = lines.number_after(line, "Node:");
      ExNode node{header, lines.take_numbers(header->numbers, "numbers of the node")};
      if (!header->coordinates.empty()) nodes[number] = std::move(node);
    } else if (!line.text.starts_with("Group name") && !line.text.starts_with("Region")) {
      lines.fail(line, fmt::format("\"{}\" is not understood", line.text),
                 "See docs/mesh-file.md for what is read.");
    }
  }
  return nodes;
}

// --- exelem -------------------------------------------------------------------------------------------------

/// How one corner of an element takes its coefficients: which number of the node, which scale factor (from 1; 0
/// for one).
struct CornerMap {
  size_t node = 0;  // of the element's, from 0
  std::array<size_t, nodal_derivatives> value{};
  std::array<size_t, nodal_derivatives> scale{};
  bool operator==(const CornerMap&) const = default;
};
using ComponentMap = std::array<CornerMap, corners>;

struct ElementHeader {
  size_t scale_factors = 0, nodes = 0;
  std::vector<ComponentMap> coordinates;
};
struct ExElement {
  ExLine line;
  std::vector<size_t> nodes;
  std::vector<double> scale_factors;
  std::shared_ptr<const ElementHeader> header;
};

std::array<size_t, nodal_derivatives> eight_indices(const ExLines& lines, const ExLine& line,
                                                    std::string_view mark) {
  const size_t start = line.text.find(mark);
  const std::vector<size_t> numbers = start == std::string::npos
                                          ? std::vector<size_t>{}
                                          : whole_numbers_in(line.text.substr(start + mark.size()));
  if (numbers.size() != nodal_derivatives)
    lines.fail(line, fmt::format("\"{}\" is not eight {}", line.text, mark),
               "A tri-cubic corner has eight whole numbers there, none of them negative.");
  std::array<size_t, nodal_derivatives> indices{};
  std::copy(numbers.begin(), numbers.end(), indices.begin());
  return indices;
}

ComponentMap read_component(ExLines& lines) {
  const ExLine basis = lines.take();
  if (!has(basis, tricubic) || !has(basis, "standard node based")) {
    lines.fail(basis, fmt::format("\"{}\" is no tri-cubic Hermite component", basis.text),
               fmt::format("Coordinates must be over {}, standard node based.", tricubic));
  }
  const ExLine count = lines.take();
  if (lines.number_after(count, "#Nodes=") != corners)
    lines.fail(count, "the element has not eight corners: it is collapsed",
               "Give each corner on a collapsed edge a node of its own in a mesh file (`shares`, `zero`).");
  ComponentMap map{};
  for (CornerMap& corner : map) {
    const ExLine head = lines.take();
    const std::vector<size_t> node = whole_numbers_in(head.text.substr(0, head.text.find('.')));
    if (node.size() != 1 || node[0] < 1) lines.fail(head, "is no corner", "Write \"1.  #Values=8\".");
    corner.node = node[0] - 1;
    corner.value = eight_indices(lines, lines.take(), "Value indices:");
    corner.scale = eight_indices(lines, lines.take(), "Scale factor indices:");
  }
  return map;
}

ElementHeader read_element_header(ExLines& lines, const ExLine& sets) {
  ElementHeader header;
  for (size_t set = lines.number_after(sets, "#Scale factor sets="); set > 0; --set)
    header.scale_factors += lines.number_after(lines.take(), "#Scale factors=");
  header.nodes = lines.number_after(lines.take(), "#Nodes=");
  const ExLine fields = lines.take();
  if (!has(fields, "#Fields="))
    lines.fail(fields, "is not the number of fields", "Write #Fields= after #Nodes=.");
  while (!lines.at_end() && !lines.peek().text.starts_with("Element:")) {
    const ExLine line = lines.take();
    if (!begins_field(line) || !has(line, ", coordinate,") || !header.coordinates.empty()) continue;
    require_cartesian(lines, line);
    for (size_t i = 0; i < 3; ++i)
      header.coordinates.push_back(read_component(lines));
  }
  if (header.coordinates.empty())
    lines.fail(fields, "no field is of type coordinate", "Export the field `coordinates` with the elements.");
  return header;
}

std::vector<size_t> take_node_numbers(ExLines& lines, const ExLine& line, size_t count) {
  const std::string rest = line.text.substr(std::string_view("Nodes:").size());
  std::vector<size_t> nodes = whole_numbers_in(rest);
  if (nodes.empty()) nodes = lines.take_whole_numbers(count, "nodes of the element");
  if (nodes.size() != count)
    lines.fail(line, fmt::format("{} nodes, not {}", nodes.size(), count), "See the header.");
  return nodes;
}

/// The tri-dimensional elements; lines and faces of the file are passed over.
std::vector<ExElement> read_elements(ExLines& lines) {
  std::vector<ExElement> elements;
  std::shared_ptr<const ElementHeader> header;
  bool solid = false;
  while (!lines.at_end()) {
    const ExLine line = lines.take();
    if (line.text.starts_with("Shape.")) {
      solid = lines.number_after(line, "Dimension=") == 3;
      if (solid && has(line, "simplex"))
        lines.fail(line, "is not a shape of hexahedra", "Only hexahedra are read.");
    } else if (solid && has(line, "#Scale factor sets=")) {
      header = std::make_shared<const ElementHeader>(read_element_header(lines, line));
    } else if (solid && line.text.starts_with("Element:")) {
      if (!header)
        lines.fail(line, "comes before any header", "Give #Scale factor sets, #Nodes and #Fields first.");
      elements.push_back({line, {}, {}, header});
    } else if (solid && !elements.empty() && line.text.starts_with("Nodes:")) {
      elements.back().nodes = take_node_numbers(lines, line, header->nodes);
    } else if (solid && !elements.empty() && line.text.starts_with("Scale factors:")) {
      elements.back().scale_factors = lines.take_numbers(header->scale_factors, "scale factors");
    }
  }
  return elements;
}

// --- the mesh -----------------------------------------------------------------------------------------------

class MeshBuilder {
 public:
  MeshBuilder(std::map<size_t, ExNode> nodes, ExLines& lines, double mm_per_unit)
      : nodes_(std::move(nodes)), lines_(lines), mm_per_unit_(mm_per_unit) {}

  ImportedMesh build(const std::vector<ExElement>& elements) {
    std::vector<HermiteMesh::Scales> scales;
    std::vector<HermiteMesh::Corners> corners_of;
    for (const ExElement& element : elements)
      add(element, corners_of.emplace_back(), scales.emplace_back());
    const size_t kept = put_scales_into_nodes(corners_of, scales);
    if (kept == 0) scales.clear();
    const HermiteMesh mesh(reference_, corners_of, {}, scales, ties_);
    for (size_t e = 0; e < elements.size(); ++e) {
      if (inside_out_at(mesh, e))
        lines_.fail(elements[e].line, "the element is left-handed or inside out",
                    "xi1, xi2, xi3 must be right-handed: exchange two of them in all elements.");
    }
    HermiteMesh named(reference_, std::move(corners_of), outer_faces(mesh), std::move(scales), ties_);
    ImportedMesh imported{{std::move(named), fibres()}, {}};
    imported.remarks.push_back(fmt::format("{} elements, {} nodes.", elements.size(), places_.size()));
    if (reference_.size() / dofs_per_node > places_.size())
      imported.remarks.push_back(
          fmt::format("{} further versions of nodes became nodes that share their value.",
                      reference_.size() / dofs_per_node - places_.size()));
    if (kept > 0)
      imported.remarks.push_back(
          fmt::format("{} scale factors differ between neighbours and are kept.", kept));
    if (!imported.body.fibres) imported.remarks.emplace_back("There are no fibre angles.");
    return imported;
  }

 private:
  /// A node as elements see it: its number, and which of its numbers they take for each component.
  using Version = std::tuple<size_t, std::array<size_t, nodal_derivatives>,
                             std::array<size_t, nodal_derivatives>, std::array<size_t, nodal_derivatives>>;

  void add(const ExElement& element, HermiteMesh::Corners& corners_of, HermiteMesh::Scales& scales) {
    const ElementHeader& header = *element.header;
    if (element.nodes.empty()) lines_.fail(element.line, "names no nodes", "Give its Nodes:.");
    std::set<size_t> numbers;
    for (size_t c = 0; c < corners; ++c) {
      const std::array<const CornerMap*, 3> maps{&header.coordinates[0][c], &header.coordinates[1][c],
                                                 &header.coordinates[2][c]};
      if (maps[0]->node >= element.nodes.size())
        lines_.fail(element.line, "a corner's node is beyond #Nodes", "Check the element's header.");
      if (maps[1]->node != maps[0]->node || maps[2]->node != maps[0]->node)
        lines_.fail(element.line, fmt::format("x, y and z of corner {} are of different nodes", c + 1),
                    "Give each corner one node for all three components.");
      if (maps[1]->scale != maps[0]->scale || maps[2]->scale != maps[0]->scale)
        lines_.fail(element.line, "x, y and z have scale factors of their own", "Use one set for all three.");
      if (!numbers.insert(element.nodes[maps[0]->node]).second)
        lines_.fail(
            element.line, fmt::format("is collapsed: it names node {} twice", element.nodes[maps[0]->node]),
            "Give each corner on a collapsed edge a node of its own in a mesh file (`shares`, `zero`).");
      corners_of[c] = node_of(element, element.nodes[maps[0]->node], maps);
      for (size_t d = 0; d < nodal_derivatives; ++d) {
        const size_t index = maps[0]->scale[d];
        if (index > element.scale_factors.size())
          lines_.fail(element.line, fmt::format("has no scale factor {}", index), "Give all Scale factors:.");
        const double scale = index == 0 ? 1.0 : element.scale_factors[index - 1];
        if (!(scale > 0.0))
          lines_.fail(element.line, fmt::format("scale factor {} is {}", index, scale),
                      "Scale factors are above zero: turn xi around instead of a derivative's sign.");
        scales[hermite_function(c, d)] = scale;
      }
    }
  }

  size_t node_of(const ExElement& element, size_t number, const std::array<const CornerMap*, 3>& maps) {
    const auto found = nodes_.find(number);
    if (found == nodes_.end())
      lines_.fail(element.line, fmt::format("names node {}, which the exnode file does not have", number),
                  "Give the exnode file that belongs to it.");
    const auto [place, is_new] =
        versions_.try_emplace({number, maps[0]->value, maps[1]->value, maps[2]->value}, versions_.size());
    const size_t node = place->second;
    if (!is_new) return node;
    reference_.resize(reference_.size() + dofs_per_node);
    numbers_.push_back(number);
    for (size_t d = 0; d < nodal_derivatives; ++d) {
      for (size_t i = 0; i < 3; ++i)
        reference_[dof_of(node, d, i)] =
            mm_per_unit_ * value_at(element, found->second, i, maps[i]->value[d], d);
      share(node, d, {number, maps[0]->value[d], maps[1]->value[d], maps[2]->value[d], d});
    }
    return node;
  }

  double value_at(const ExElement& element, const ExNode& node, size_t component, size_t index,
                  size_t derivative) {
    const NodeComponent& numbers = node.header->coordinates[component];
    const size_t width = numbers.derivatives.size();
    if (index < 1 || index > width * numbers.versions)
      lines_.fail(element.line,
                  fmt::format("takes number {} of a node that has {}", index, width * numbers.versions),
                  "A tri-cubic corner needs a value and seven derivatives of its node.");
    if (numbers.derivatives[(index - 1) % width] != derivative)
      lines_.fail(
          element.line,
          fmt::format("takes a node's {} for {}", ex_derivatives[numbers.derivatives[(index - 1) % width]],
                      ex_derivatives[derivative]),
          "Elements around a node must have their xi along the node's s1, s2, s3.");
    return node.numbers[numbers.start + index - 1];
  }

  /// Versions of a node are at one place, and share the derivatives that they take from the same number.
  void share(size_t node, size_t derivative, const std::array<size_t, 5>& numbers) {
    size_t first = node;
    if (derivative == 0) {
      first = places_.try_emplace(numbers[0], node).first->second;
      for (size_t i = 0; i < 3; ++i)
        reference_[dof_of(node, 0, i)] = reference_[dof_of(first, 0, i)];
    } else {
      first = shared_.try_emplace(numbers, node).first->second;
    }
    if (first == node) return;
    for (size_t i = 0; i < 3; ++i)
      ties_.same.emplace_back(dof_of(node, derivative, i), dof_of(first, derivative, i));
  }

  /// A factor that is the same in all elements around goes into the nodal value. Returns how many are left.
  size_t put_scales_into_nodes(const std::vector<HermiteMesh::Corners>& corners_of,
                               std::vector<HermiteMesh::Scales>& scales) {
    std::map<size_t, size_t> host;  // of the first component's dofs
    for (const auto& [dof, other] : ties_.same)
      host[dof] = other;
    const auto shared = [&](size_t node, size_t derivative) {
      const size_t dof = dof_of(node, derivative, 0);
      const auto found = host.find(dof);
      return found == host.end() ? dof : found->second;
    };
    std::map<size_t, std::pair<double, double>> range;
    for (size_t e = 0; e < scales.size(); ++e) {
      for (size_t a = 0; a < hermite_functions; ++a) {
        const double scale = scales[e][a];
        auto& [low, high] =
            range.try_emplace(shared(corners_of[e][hermite_corner(a)], hermite_derivative(a)), scale, scale)
                .first->second;
        low = std::min(low, scale);
        high = std::max(high, scale);
      }
    }
    const auto agreed = [&](size_t node, size_t derivative) {
      const auto [low, high] = range.at(shared(node, derivative));
      return high - low <= scale_slack * std::abs(high);
    };
    for (size_t node = 0; node < reference_.size() / dofs_per_node; ++node) {
      for (size_t d = 0; d < nodal_derivatives; ++d) {
        for (size_t i = 0; i < 3 && agreed(node, d); ++i)
          reference_[dof_of(node, d, i)] *= range.at(shared(node, d)).second;
      }
    }
    size_t kept = 0;
    for (size_t e = 0; e < scales.size(); ++e) {
      for (size_t a = 0; a < hermite_functions; ++a) {
        if (agreed(corners_of[e][hermite_corner(a)], hermite_derivative(a))) {
          scales[e][a] = 1.0;
        } else {
          ++kept;
        }
      }
    }
    return kept;
  }

  static MeshFaces outer_faces(const HermiteMesh& mesh) {
    const FaceMap map(mesh);
    MeshFaces faces;
    const std::array<std::vector<ElementFace>*, 6> lists{&faces.left, &faces.right, &faces.bottom,
                                                         &faces.top,  &faces.inner, &faces.outer};
    for (size_t e = 0; e < mesh.element_count(); ++e) {
      for (size_t side = 0; side < lists.size(); ++side) {
        const ElementFace face{e, side / 2, side % 2};
        if (map.is_outer(face)) lists[side]->push_back(face);
      }
    }
    return faces;
  }

  [[nodiscard]] std::optional<FibreField> fibres() const {
    std::vector<double> angles_deg;
    for (const size_t number : numbers_) {
      const ExNode& node = nodes_.at(number);
      if (!node.header->fibre) return {};
      angles_deg.push_back(node.numbers[*node.header->fibre] / rad_per_deg);
    }
    return FibreField(std::move(angles_deg));
  }

  std::map<size_t, ExNode> nodes_;
  ExLines& lines_;
  double mm_per_unit_;
  NodeField reference_;
  DofTies ties_;
  std::vector<size_t> numbers_;  // the exnode number of each node
  std::map<Version, size_t> versions_;
  std::map<size_t, size_t> places_;                 // first node at an exnode number
  std::map<std::array<size_t, 5>, size_t> shared_;  // first node that takes these numbers
};

}  // namespace

ImportedMesh import_exfiles(const NamedText& exnode, const NamedText& exelem, double mm_per_unit) {
  std::map<size_t, ExNode> nodes = read_nodes(exnode);
  ExLines lines(exelem.text, exelem.file);
  const std::vector<ExElement> elements = read_elements(lines);
  if (elements.empty())
    lines.fail({"", 1}, "holds no element of three dimensions", "Give the exelem file with the hexahedra.");
  return MeshBuilder(std::move(nodes), lines, mm_per_unit).build(elements);
}

}  // namespace diastole
