#include "estimator/grids/feb_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <pugixml.hpp>
#include <span>
#include <sstream>

namespace diastole {
namespace {

constexpr int steps_a_pressure = 10;

pugi::xml_node child(pugi::xml_node parent, const char* name, const std::string& text) {
  pugi::xml_node node = parent.append_child(name);
  node.text() = text.c_str();
  return node;
}

template <class Numbers>
std::string listed(const Numbers& numbers) {
  return fmt::format("{}", fmt::join(numbers, ","));
}

/// FEBio counts from 1.
std::string nodes_of(const GridCell& cell) {
  std::vector<size_t> nodes;
  for (const size_t point : cell.points)
    nodes.push_back(point + 1);
  return listed(nodes);
}

void add_control(pugi::xml_node root, size_t pressures) {
  root.append_child("Module").append_attribute("type") = "solid";
  pugi::xml_node control = root.append_child("Control");
  child(control, "analysis", "STATIC");
  child(control, "time_steps", fmt::format("{}", steps_a_pressure * static_cast<int>(pressures)));
  child(control, "step_size", fmt::format("{}", 1.0 / steps_a_pressure));
  pugi::xml_node stepper = control.append_child("time_stepper");
  stepper.append_attribute("type") = "default";
  child(stepper, "max_retries", "10");
  child(stepper, "dtmin", "0.0001");
  child(stepper, "dtmax", fmt::format("{}", 1.0 / steps_a_pressure));
  control.append_child("solver").append_attribute("type") = "solid";
}

void add_material(pugi::xml_node root, const FebMaterial& given) {
  pugi::xml_node material = root.append_child("Material").append_child("material");
  material.append_attribute("id") = 1;
  material.append_attribute("name") = "tissue";
  material.append_attribute("type") = given.type.c_str();
  for (const auto& [name, value] : given.parameters)
    child(material, name.c_str(), fmt::format("{}", value));
}

/// Parts of one shape each: FEBio's domains are. Returns their names with the cells of each.
std::vector<std::pair<std::string, std::vector<size_t>>> parts_of(const FieldGrid& grid) {
  std::vector<std::pair<std::string, std::vector<size_t>>> parts;
  for (const auto& [shape, name] :
       {std::pair{CellShape::hexahedron, "bricks"}, std::pair{CellShape::wedge, "wedges"}}) {
    std::vector<size_t> cells;
    for (size_t c = 0; c < grid.cells.size(); ++c)
      if (grid.cells[c].shape == shape) cells.push_back(c);
    if (!cells.empty()) parts.emplace_back(name, std::move(cells));
  }
  return parts;
}

void add_mesh(pugi::xml_node root, const FebModel& model) {
  const FieldGrid& grid = *model.grid;
  pugi::xml_node mesh = root.append_child("Mesh"), nodes = mesh.append_child("Nodes");
  nodes.append_attribute("name") = "nodes";
  for (size_t p = 0; p < grid.point_count(); ++p)
    child(nodes, "node", listed(std::span(grid.points).subspan(3 * p, 3))).append_attribute("id") =
        static_cast<unsigned>(p + 1);
  for (const auto& [name, cells] : parts_of(grid)) {
    pugi::xml_node elements = mesh.append_child("Elements");
    elements.append_attribute("type") = name == "bricks" ? "hex8" : "penta6";
    elements.append_attribute("name") = name.c_str();
    for (const size_t c : cells)
      child(elements, "elem", nodes_of(grid.cells[c])).append_attribute("id") = static_cast<unsigned>(c + 1);
  }
  std::vector<size_t> held;
  for (const size_t point : model.held)
    held.push_back(point + 1);
  child(mesh, "NodeSet", listed(held)).append_attribute("name") = "held";
  pugi::xml_node surface = mesh.append_child("Surface");
  surface.append_attribute("name") = "cavity";
  for (size_t f = 0; f < model.pressed.size(); ++f)
    child(surface, model.pressed[f].points.size() == 3 ? "tri3" : "quad4", nodes_of(model.pressed[f]))
        .append_attribute("id") = static_cast<unsigned>(f + 1);
  pugi::xml_node domains = root.append_child("MeshDomains");
  for (const auto& [name, cells] : parts_of(grid)) {
    pugi::xml_node domain = domains.append_child("SolidDomain");
    domain.append_attribute("name") = name.c_str();
    domain.append_attribute("mat") = "tissue";
  }
}

void add_axes(pugi::xml_node root, const FebModel& model) {
  if (model.axes.empty()) return;
  pugi::xml_node data = root.append_child("MeshData");
  for (const auto& [name, cells] : parts_of(*model.grid)) {
    pugi::xml_node part = data.append_child("ElementData");
    part.append_attribute("type") = "mat_axis";
    part.append_attribute("elem_set") = name.c_str();
    for (size_t i = 0; i < cells.size(); ++i) {
      pugi::xml_node element = part.append_child("elem");
      element.append_attribute("lid") = static_cast<unsigned>(i + 1);
      const std::span<const double> axes = model.axes[cells[i]];
      child(element, "a", listed(axes.first(3)));
      child(element, "d", listed(axes.last(3)));
    }
  }
}

void add_supports_and_loads(pugi::xml_node root, const FebModel& model) {
  pugi::xml_node support = root.append_child("Boundary").append_child("bc");
  support.append_attribute("name") = "held";
  support.append_attribute("type") = "zero displacement";
  support.append_attribute("node_set") = "held";
  for (const char* direction : {"x_dof", "y_dof", "z_dof"})
    child(support, direction, "1");
  pugi::xml_node load = root.append_child("Loads").append_child("surface_load");
  load.append_attribute("name") = "cavity pressure";
  load.append_attribute("type") = "pressure";
  load.append_attribute("surface") = "cavity";
  child(load, "pressure", "1").append_attribute("lc") = 1;
  child(load, "linear", "0");
  child(load, "symmetric_stiffness", "1");
  pugi::xml_node curve = root.append_child("LoadData").append_child("load_controller");
  curve.append_attribute("id") = 1;
  curve.append_attribute("type") = "loadcurve";
  child(curve, "interpolate", "LINEAR");
  pugi::xml_node points = curve.append_child("points");
  child(points, "pt", "0,0");
  for (size_t i = 0; i < model.pressures_kPa.size(); ++i)
    child(points, "pt", fmt::format("{},{}", i + 1, model.pressures_kPa[i]));
}

void add_output(pugi::xml_node root) {
  pugi::xml_node plot = root.append_child("Output").append_child("plotfile");
  plot.append_attribute("type") = "febio";
  for (const char* variable : {"displacement", "stress"})
    plot.append_child("var").append_attribute("type") = variable;
}

}  // namespace

std::string feb_text(const FebModel& model) {
  pugi::xml_document document;
  pugi::xml_node declaration = document.append_child(pugi::node_declaration);
  declaration.append_attribute("version") = "1.0";
  declaration.append_attribute("encoding") = "UTF-8";
  pugi::xml_node root = document.append_child("febio_spec");
  root.append_attribute("version") = "4.0";
  add_control(root, model.pressures_kPa.size());
  add_material(root, model.material);
  add_mesh(root, model);
  add_axes(root, model);
  add_supports_and_loads(root, model);
  add_output(root);
  std::ostringstream text;
  document.save(text, " ");
  return text.str();
}

}  // namespace diastole
