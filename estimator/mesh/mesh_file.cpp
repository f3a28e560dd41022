#include "estimator/mesh/mesh_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "estimator/mesh/face_map.hpp"
#include "protocol/contract/table_reader.hpp"

namespace diastole {
namespace {

constexpr std::array<const char*, 3> coordinate_keys{"x_mm", "y_mm", "z_mm"};
constexpr std::array<std::string_view, nodal_derivatives> derivative_names{"value", "d1",  "d2",  "d12",
                                                                           "d3",    "d13", "d23", "d123"};
constexpr double tie_slack = 1e-9;  // of the body's extent

struct FaceLabel {
  std::string_view name;
  std::vector<ElementFace> MeshFaces::*list;
};
constexpr std::array<FaceLabel, 6> face_labels{{{"inner", &MeshFaces::inner},
                                                {"outer", &MeshFaces::outer},
                                                {"bottom", &MeshFaces::bottom},
                                                {"top", &MeshFaces::top},
                                                {"left", &MeshFaces::left},
                                                {"right", &MeshFaces::right}}};

/// The shortest text that reads back to the same number, with a point or an exponent as TOML wants it.
std::string exact(double value) {
  std::string text = fmt::format("{}", value);
  if (text.find_first_of(".en") == std::string::npos) text += ".0";
  return text;
}

template <class Values>
std::string exact_list(const Values& values) {
  std::vector<std::string> texts;
  for (const double value : values)
    texts.push_back(exact(value));
  return fmt::format("[{}]", fmt::join(texts, ", "));
}

std::string quoted_list(const std::vector<std::string>& texts) {
  return fmt::format("[\"{}\"]", fmt::join(texts, "\", \""));
}

/// Zero and shared derivatives of each node, as the file says them.
struct NodeTies {
  std::vector<std::vector<std::string>> zero, shares;
};

NodeTies ties_by_node(const HermiteMesh& mesh) {
  NodeTies ties{std::vector<std::vector<std::string>>(mesh.node_count()),
                std::vector<std::vector<std::string>>(mesh.node_count())};
  const auto is_first_component = [](size_t dof) { return dof % 3 == 0; };
  const auto name_of = [](size_t dof) { return derivative_names[dof % dofs_per_node / 3]; };
  for (const size_t dof : mesh.ties().zero) {
    if (is_first_component(dof)) ties.zero[dof / dofs_per_node].emplace_back(name_of(dof));
  }
  for (const auto& [dof, host] : mesh.ties().same) {
    if (is_first_component(dof)) {
      ties.shares[dof / dofs_per_node].push_back(
          fmt::format("{} {}", name_of(dof), host / dofs_per_node + 1));
    }
  }
  return ties;
}

std::vector<std::vector<std::string>> faces_by_element(const HermiteMesh& mesh) {
  std::vector<std::vector<std::string>> faces(mesh.element_count());
  for (const FaceLabel& label : face_labels) {
    for (const ElementFace& face : mesh.faces().*label.list)
      faces[face.element].push_back(fmt::format("{} xi{}={}", label.name, face.direction + 1, face.side));
  }
  return faces;
}

std::array<double, hermite_functions> scales_in_order(const HermiteMesh& mesh, size_t element) {
  std::array<double, hermite_functions> scales{};
  for (size_t i = 0; i < hermite_functions; ++i)
    scales[i] = mesh.scale(element, hermite_function(i / nodal_derivatives, i % nodal_derivatives));
  return scales;
}

size_t derivative_named(TableReader& table, std::string_view key, std::string_view name) {
  const auto found = std::find(derivative_names.begin(), derivative_names.end(), name);
  if (found == derivative_names.end()) {
    table.fail(key, fmt::format("\"{}\" is no nodal derivative", name),
               fmt::format("Known: {}.", fmt::join(derivative_names, ", ")));
  }
  return static_cast<size_t>(found - derivative_names.begin());
}

/// Reads the file's parts into what a HermiteMesh is made of.
class MeshReader {
 public:
  explicit MeshReader(TableReader root) : root_(std::move(root)), nodes_(), elements_() {
    root_.expect_format(mesh_file_mark, 1);
    nodes_ = root_.tables("node");
    elements_ = root_.tables("element");
    if (nodes_.empty()) root_.fail("node", "is missing", "Write each node as [[node]].");
    if (elements_.empty()) root_.fail("element", "is missing", "Write each element as [[element]].");
  }

  MeshBody read() {
    reference_.assign(nodes_.size() * dofs_per_node, 0.0);
    for (size_t node = 0; node < nodes_.size(); ++node)
      read_values(node);
    for (size_t node = 0; node < nodes_.size(); ++node)
      read_ties(node);
    std::vector<HermiteMesh::Corners> corners_of;
    std::vector<HermiteMesh::Scales> scales;
    MeshFaces faces;
    for (size_t element = 0; element < elements_.size(); ++element) {
      corners_of.push_back(read_corners(element));
      read_scales(element, scales);
      read_faces(element, faces);
    }
    require_all_used(corners_of);
    std::optional<FibreField> fibres = read_fibres();
    HermiteMesh mesh(reference_, std::move(corners_of), std::move(faces), std::move(scales),
                     std::move(ties_));
    require_ties_kept(mesh);
    require_right_side_out(mesh);
    require_outer_faces(mesh);
    finish();
    return {std::move(mesh), std::move(fibres)};
  }

 private:
  void read_values(size_t node) {
    for (size_t i = 0; i < 3; ++i) {
      const std::vector<double> values = nodes_[node].numbers(coordinate_keys[i], nodal_derivatives);
      for (size_t d = 0; d < nodal_derivatives; ++d)
        reference_[dof_of(node, d, i)] = values[d];
    }
  }

  void read_ties(size_t node) {
    TableReader& table = nodes_[node];
    for (const std::string& name : table.texts_or("zero", {})) {
      const size_t derivative = derivative_named(table, "zero", name);
      for (size_t i = 0; i < 3; ++i)
        ties_.zero.push_back(dof_of(node, derivative, i));
    }
    for (const std::string& text : table.texts_or("shares", {})) {
      const size_t space = text.find(' ');
      size_t other = 0;
      const char* const end = text.data() + text.size();
      if (space == std::string::npos || std::from_chars(text.data() + space + 1, end, other).ptr != end) {
        table.fail("shares", fmt::format("\"{}\" is not a derivative and a node", text),
                   "Write for example shares = [\"value 3\"].");
      }
      const size_t derivative = derivative_named(table, "shares", text.substr(0, space));
      if (other < 1 || other > nodes_.size() || other - 1 == node) {
        table.fail("shares", fmt::format("\"{}\" names no other node", text),
                   fmt::format("Nodes are numbered 1 to {} in the file's order.", nodes_.size()));
      }
      for (size_t i = 0; i < 3; ++i)
        ties_.same.emplace_back(dof_of(node, derivative, i), dof_of(other - 1, derivative, i));
    }
  }

  HermiteMesh::Corners read_corners(size_t element) {
    TableReader& table = elements_[element];
    HermiteMesh::Corners corners_of{};
    const std::vector<int64_t> numbers =
        table.integers("nodes", corners, {.at_least = 1, .at_most = static_cast<double>(nodes_.size())});
    for (size_t c = 0; c < corners; ++c) {
      corners_of[c] = static_cast<size_t>(numbers[c]) - 1;
      if (std::find(corners_of.begin(), corners_of.begin() + static_cast<std::ptrdiff_t>(c), corners_of[c]) !=
          corners_of.begin() + static_cast<std::ptrdiff_t>(c)) {
        table.fail("nodes", fmt::format("names node {} twice", numbers[c]),
                   "On a collapsed edge give each corner a node of its own that `shares` the other's value.");
      }
    }
    return corners_of;
  }

  void read_scales(size_t element, std::vector<HermiteMesh::Scales>& scales) {
    TableReader& table = elements_[element];
    HermiteMesh::Scales of_element;
    of_element.fill(1.0);
    const bool given = table.has("scale");
    if (given) {
      const std::vector<double> numbers = table.numbers("scale", hermite_functions, {.above = 0});
      for (size_t i = 0; i < hermite_functions; ++i)
        of_element[hermite_function(i / nodal_derivatives, i % nodal_derivatives)] = numbers[i];
      if (scales.empty()) {
        HermiteMesh::Scales ones;
        ones.fill(1.0);
        scales.assign(element, ones);
      }
    }
    if (given || !scales.empty()) scales.push_back(of_element);
  }

  void read_faces(size_t element, MeshFaces& faces) {
    TableReader& table = elements_[element];
    for (const std::string& text : table.texts_or("faces", {})) {
      const auto label = std::find_if(face_labels.begin(), face_labels.end(), [&](const FaceLabel& known) {
        return text.starts_with(std::string(known.name) + " xi");
      });
      const std::string_view place = label == face_labels.end()
                                         ? std::string_view()
                                         : std::string_view(text).substr(label->name.size() + 3);
      const bool fits = place.size() == 3 && place[0] >= '1' && place[0] <= '3' && place[1] == '=' &&
                        (place[2] == '0' || place[2] == '1');
      if (!fits) {
        table.fail("faces", fmt::format("\"{}\" is no face", text),
                   "Write a name (inner, outer, bottom, top, left, right) and a side, as \"inner xi3=0\".");
      }
      const ElementFace face{element, static_cast<size_t>(place[0] - '1'),
                             static_cast<size_t>(place[2] - '0')};
      for (const auto& [known, words] : named_faces_) {
        if (known.element == element && known.direction == face.direction && known.side == face.side)
          table.fail("faces", fmt::format("\"{}\" and \"{}\" are one side of the element", words, text),
                     "Name each side once.");
      }
      named_faces_.emplace_back(face, text);
      (faces.*label->list).push_back(face);
    }
  }

  std::optional<FibreField> read_fibres() {
    std::vector<double> fibre_deg;
    std::vector<double> sheet_deg;
    std::vector<double> transverse_deg;
    for (const auto& [key, list] : {std::pair("fibre_deg", &fibre_deg), std::pair("sheet_deg", &sheet_deg),
                                    std::pair("transverse_deg", &transverse_deg)}) {
      const bool wanted = nodes_.front().has(key);
      for (TableReader& table : nodes_) {
        if (table.has(key) != wanted) {
          table.fail(key,
                     wanted ? "is missing, although the first node has it"
                            : "is given, although the first node has none",
                     "Give it for all nodes or for none.");
        }
        if (wanted) list->push_back(table.number(key, {.at_least = -360, .at_most = 360}));
      }
    }
    for (const auto& [key, list] :
         {std::pair("sheet_deg", &sheet_deg), std::pair("transverse_deg", &transverse_deg)})
      if (fibre_deg.empty() && !list->empty())
        nodes_.front().fail(key, "is given without fibre_deg", "Give both.");
    if (fibre_deg.empty()) return {};
    return FibreField(std::move(fibre_deg), std::move(sheet_deg), std::move(transverse_deg));
  }

  void require_all_used(const std::vector<HermiteMesh::Corners>& corners_of) {
    std::vector<bool> used(nodes_.size(), false);
    for (const HermiteMesh::Corners& element : corners_of) {
      for (const size_t node : element)
        used[node] = true;
    }
    const auto unused = std::find(used.begin(), used.end(), false);
    if (unused == used.end()) return;
    nodes_[static_cast<size_t>(unused - used.begin())].fail("x_mm", "belongs to a node of no element",
                                                            "Remove the node, or name it in an element.");
  }

  void require_ties_kept(const HermiteMesh& mesh) {
    const double slack_mm = tie_slack * mesh.extent_mm();
    std::vector<bool> dependent(reference_.size(), false);
    for (const size_t dof : mesh.ties().zero) {
      dependent[dof] = true;
      if (std::abs(reference_[dof]) > slack_mm) {
        nodes_[dof / dofs_per_node].fail(
            "zero", fmt::format("{} is {}", derivative_names[dof % dofs_per_node / 3], reference_[dof]),
            "Write 0.0 for it, or leave it out of `zero`.");
      }
    }
    for (const auto& [dof, host] : mesh.ties().same) {
      TableReader& table = nodes_[dof / dofs_per_node];
      const std::string_view name = derivative_names[dof % dofs_per_node / 3];
      if (dependent[dof])
        table.fail("shares", fmt::format("{} is already tied", name), "Say once what it depends on.");
      dependent[dof] = true;
      if (std::abs(reference_[dof] - reference_[host]) > slack_mm) {
        table.fail(
            "shares",
            fmt::format("{} is {}, but the other node's is {}", name, reference_[dof], reference_[host]),
            "Give both nodes the same numbers, or do not share them.");
      }
    }
    for (const auto& [dof, host] : mesh.ties().same) {
      if (dependent[host]) {
        nodes_[dof / dofs_per_node].fail(
            "shares", fmt::format("node {} itself shares it or has it zero", host / dofs_per_node + 1),
            "Name the node that all of them share it with.");
      }
    }
  }

  void require_right_side_out(const HermiteMesh& mesh) {
    for (size_t element = 0; element < mesh.element_count(); ++element) {
      const std::optional<Xi> place = inside_out_at(mesh, element);
      if (!place) continue;
      elements_[element].fail("nodes",
                              fmt::format("the element is inside out at xi = ({})", fmt::join(*place, ", ")),
                              "Order the corners with xi1 fastest, then xi2, then xi3, right-handed, and "
                              "check the derivatives' signs.");
    }
  }

  /// Loads and supports are on the body's surface: no second element has a named face.
  void require_outer_faces(const HermiteMesh& mesh) {
    // Two elements that close a ring have the corners of their inner faces in common, but not the middles.
    const auto middle_mm = [&](const ElementFace& face) {
      Xi xi{0.5, 0.5, 0.5};
      xi[face.direction] = static_cast<double>(face.side);
      return mesh.value(mesh.reference(), {face.element, xi});
    };
    const FaceMap map(mesh);
    const double slack_mm = tie_slack * mesh.extent_mm();
    for (const auto& [named, words] : named_faces_) {
      for (const ElementFace& other : map.meeting(named)) {
        if (other.element == named.element || (middle_mm(other) - middle_mm(named)).norm() > slack_mm)
          continue;
        elements_[named.element].fail(
            "faces",
            fmt::format("\"{}\" lies inside the body: element {} has it too", words, other.element + 1),
            "Name outer faces only.");
      }
    }
  }

  void finish() {
    for (TableReader& table : nodes_)
      table.finish();
    for (TableReader& table : elements_)
      table.finish();
    root_.finish();
  }

  TableReader root_;
  std::vector<TableReader> nodes_;
  std::vector<TableReader> elements_;
  NodeField reference_;
  DofTies ties_;
  std::vector<std::pair<ElementFace, std::string>> named_faces_;
};

}  // namespace

std::optional<Xi> inside_out_at(const HermiteMesh& mesh, size_t element) {
  constexpr std::array<double, 3> places{0.1, 0.5, 0.9};
  for (size_t sample = 0; sample < 27; ++sample) {
    const Xi xi{places[sample % 3], places[sample / 3 % 3], places[sample / 9]};
    if (!(mesh.xi_gradient(mesh.reference(), {element, xi}).determinant() > 0.0)) return xi;
  }
  return {};
}

std::string mesh_file_text(const MeshBody& body) {
  const HermiteMesh& mesh = body.mesh;
  std::string text = fmt::format("format = \"{}\"\nversion = 1\n", mesh_file_mark);
  const auto out = std::back_inserter(text);
  const NodeTies ties = ties_by_node(mesh);
  for (size_t node = 0; node < mesh.node_count(); ++node) {
    fmt::format_to(out, "\n[[node]]  # {}\n", node + 1);
    for (size_t i = 0; i < 3; ++i) {
      std::array<double, nodal_derivatives> values{};
      for (size_t d = 0; d < nodal_derivatives; ++d)
        values[d] = mesh.reference()[dof_of(node, d, i)];
      fmt::format_to(out, "{} = {}\n", coordinate_keys[i], exact_list(values));
    }
    if (body.fibres) fmt::format_to(out, "fibre_deg = {}\n", exact(body.fibres->nodal_fibre_deg()[node]));
    if (body.fibres && !body.fibres->nodal_sheet_deg().empty())
      fmt::format_to(out, "sheet_deg = {}\n", exact(body.fibres->nodal_sheet_deg()[node]));
    if (body.fibres && !body.fibres->nodal_transverse_deg().empty())
      fmt::format_to(out, "transverse_deg = {}\n", exact(body.fibres->nodal_transverse_deg()[node]));
    if (!ties.zero[node].empty()) fmt::format_to(out, "zero = {}\n", quoted_list(ties.zero[node]));
    if (!ties.shares[node].empty()) fmt::format_to(out, "shares = {}\n", quoted_list(ties.shares[node]));
  }
  const std::vector<std::vector<std::string>> faces = faces_by_element(mesh);
  for (size_t element = 0; element < mesh.element_count(); ++element) {
    fmt::format_to(out, "\n[[element]]  # {}\n", element + 1);
    std::vector<size_t> numbers;
    for (const size_t node : mesh.element(element))
      numbers.push_back(node + 1);
    fmt::format_to(out, "nodes = [{}]\n", fmt::join(numbers, ", "));
    if (!faces[element].empty()) fmt::format_to(out, "faces = {}\n", quoted_list(faces[element]));
    const std::array<double, hermite_functions> scales = scales_in_order(mesh, element);
    if (std::any_of(scales.begin(), scales.end(), [](double scale) { return scale != 1.0; }))
      fmt::format_to(out, "scale = {}\n", exact_list(scales));
  }
  return text;
}

MeshBody read_mesh_file(const std::filesystem::path& path) {
  return MeshReader(TableReader::from_file(path)).read();
}

MeshBody mesh_from_text(std::string_view text, const std::string& name) {
  return MeshReader(TableReader::from_text(text, name)).read();
}

}  // namespace diastole
