#include "estimator/grids/vtu_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <sstream>
#include <stdexcept>

#include "estimator/grids/vtu_data.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"

namespace diastole {
namespace {

[[noreturn]] void refuse(const std::string& file, std::string place, std::string problem) {
  throw InputError({file, std::move(place), std::move(problem),
                    "Export it again from ParaView or meshio as a VTK unstructured grid (.vtu)."});
}

/// Cuts appended data out of the text: raw bytes are no XML.
VtuEncoding cut_appended(std::string& text) {
  VtuEncoding encoding;
  const size_t tag = text.find("<AppendedData"), end = text.rfind("</AppendedData>");
  if (tag == std::string::npos || end == std::string::npos || end < tag) return encoding;
  const size_t from = text.find('_', text.find('>', tag));
  if (from == std::string::npos || from > end) return encoding;
  encoding.appended_raw = text.substr(tag, from - tag).find("raw") != std::string::npos;
  encoding.appended = text.substr(from + 1, end - from - 1);
  text.erase(from, end - from);
  return encoding;
}

/// Where VTK keeps a wedge's corners: its triangle 0 1 2 looks outwards (vtkWedge). Its own inverse.
constexpr std::array<size_t, 6> wedge_order{0, 2, 1, 3, 5, 4};

size_t place_in_vtk(CellShape shape, size_t corner) {
  return shape == CellShape::wedge ? wedge_order[corner] : corner;
}

class VtuReader {
 public:
  explicit VtuReader(const std::string& path) : file_(path), text_(read_whole_file(path)) {
    encoding_ = cut_appended(text_);
    const pugi::xml_parse_result parsed = document_.load_buffer(text_.data(), text_.size());
    if (!parsed) refuse(file_, fmt::format("byte {}", parsed.offset), parsed.description());
  }

  FieldGrid read() {
    const pugi::xml_node root = document_.child("VTKFile"), grid = root.child("UnstructuredGrid");
    if (!grid) refuse(file_, "", "is no VTK unstructured grid");
    if (std::string_view(root.attribute("byte_order").as_string("LittleEndian")) != "LittleEndian")
      refuse(file_, "VTKFile", "is big-endian");
    const std::string_view compressor = root.attribute("compressor").as_string();
    if (!compressor.empty() && compressor != "vtkZLibDataCompressor")
      refuse(file_, "VTKFile", fmt::format("is compressed by {}, which is not read", compressor));
    encoding_.compressed = !compressor.empty();
    encoding_.wide_header = std::string_view(root.attribute("header_type").as_string()) == "UInt64";
    const pugi::xml_node piece = grid.child("Piece");
    if (!piece || piece.next_sibling("Piece")) refuse(file_, "UnstructuredGrid", "has not exactly one piece");
    FieldGrid result;
    result.points = numbers(piece.child("Points").child("DataArray"), "Points");
    read_cells(piece.child("Cells"), result);
    result.cell_data = arrays(piece.child("CellData"));
    GridStep& step = result.steps.emplace_back();
    step.point_data = arrays(piece.child("PointData"));
    for (const pugi::xml_node& array : grid.child("FieldData").children("DataArray")) {
      const std::string name = array.attribute("Name").as_string();
      const std::vector<double> values = numbers(array, name);
      if (name == "TimeValue" && !values.empty()) step.time_s = values.front();
      if (name != "TimeValue" && values.size() == 1) step.field_data.push_back({name, 1, values});
    }
    return result;
  }

 private:
  std::vector<double> numbers(const pugi::xml_node& array, const std::string& name) {
    if (!array) refuse(file_, name, "is missing");
    try {
      return numbers_of(array, encoding_);
    } catch (const std::invalid_argument& error) {
      refuse(file_, fmt::format("array {}", name), error.what());
    }
  }
  std::vector<GridArray> arrays(const pugi::xml_node& group) {
    std::vector<GridArray> result;
    for (const pugi::xml_node& array : group.children("DataArray")) {
      const std::string name = array.attribute("Name").as_string();
      result.push_back({name, array.attribute("NumberOfComponents").as_uint(1), numbers(array, name)});
    }
    return result;
  }
  void read_cells(const pugi::xml_node& cells, FieldGrid& grid) {
    const auto array = [&](const char* name) {
      return numbers(cells.find_child_by_attribute("DataArray", "Name", name), name);
    };
    const std::vector<double> connectivity = array("connectivity"), offsets = array("offsets"),
                              types = array("types");
    if (offsets.size() != types.size()) refuse(file_, "Cells", "offsets and types differ in length");
    double from = 0.0;
    for (size_t c = 0; c < types.size(); ++c) {
      const auto kind = std::ranges::find(cell_kinds(), static_cast<int>(types[c]), &CellKind::vtk);
      if (kind == cell_kinds().end())
        refuse(file_, fmt::format("cell {}", c), fmt::format("type {} is not known", types[c]));
      if (!(offsets[c] - from >= static_cast<double>(kind->points)) ||
          offsets[c] > static_cast<double>(connectivity.size()))
        refuse(file_, fmt::format("cell {}", c), "has too few points");
      GridCell& cell = grid.cells.emplace_back(GridCell{kind->shape, {}});
      for (size_t i = 0; i < corner_count(kind->shape); ++i) {
        const double point = connectivity[static_cast<size_t>(from) + place_in_vtk(kind->shape, i)];
        if (!(point >= 0)) refuse(file_, fmt::format("cell {}", c), fmt::format("names point {}", point));
        cell.points.push_back(static_cast<size_t>(point));
      }
      from = offsets[c];
    }
  }

  std::string file_, text_;
  VtuEncoding encoding_;
  pugi::xml_document document_;
};

void add_array(pugi::xml_node group, const char* type, const GridArray& array) {
  pugi::xml_node node = group.append_child("DataArray");
  node.append_attribute("type") = type;
  node.append_attribute("Name") = array.name.c_str();
  node.append_attribute("NumberOfComponents") = static_cast<unsigned>(array.components);
  node.append_attribute("format") = "ascii";
  node.text() = fmt::format("{}", fmt::join(array.values, " ")).c_str();
}

}  // namespace

FieldGrid read_vtu(const std::string& path) {
  FieldGrid grid = VtuReader(path).read();
  require_sound(grid, path);
  return grid;
}

std::string vtu_text(const FieldGrid& grid, const GridStep& step) {
  pugi::xml_document document;
  pugi::xml_node root = document.append_child("VTKFile");
  root.append_attribute("type") = "UnstructuredGrid";
  root.append_attribute("version") = "1.0";
  root.append_attribute("byte_order") = "LittleEndian";
  pugi::xml_node unstructured = root.append_child("UnstructuredGrid");
  pugi::xml_node field = unstructured.append_child("FieldData");
  const auto add_single = [&](const std::string& name, double value) {
    pugi::xml_node node = field.append_child("DataArray");
    node.append_attribute("type") = "Float64";
    node.append_attribute("Name") = name.c_str();
    node.append_attribute("NumberOfTuples") = 1;
    node.append_attribute("format") = "ascii";
    node.text() = fmt::format("{}", value).c_str();
  };
  add_single("TimeValue", step.time_s);
  for (const GridArray& array : step.field_data)
    add_single(array.name, array.values.front());
  pugi::xml_node piece = unstructured.append_child("Piece");
  piece.append_attribute("NumberOfPoints") = static_cast<unsigned long long>(grid.point_count());
  piece.append_attribute("NumberOfCells") = static_cast<unsigned long long>(grid.cells.size());
  add_array(piece.append_child("Points"), "Float64", {"Points", 3, grid.points});
  GridArray connectivity{"connectivity", 1, {}}, offsets{"offsets", 1, {}}, types{"types", 1, {}};
  for (const GridCell& cell : grid.cells) {
    for (size_t i = 0; i < cell.points.size(); ++i)
      connectivity.values.push_back(static_cast<double>(cell.points[place_in_vtk(cell.shape, i)]));
    offsets.values.push_back(static_cast<double>(connectivity.values.size()));
    types.values.push_back(std::ranges::find(cell_kinds(), cell.shape, &CellKind::shape)->vtk);
  }
  pugi::xml_node cells = piece.append_child("Cells");
  add_array(cells, "Int64", connectivity);
  add_array(cells, "Int64", offsets);
  add_array(cells, "UInt8", types);
  for (const GridArray& array : step.point_data)
    add_array(piece.child("PointData") ? piece.child("PointData") : piece.append_child("PointData"),
              "Float64", array);
  for (const GridArray& array : grid.cell_data)
    add_array(piece.child("CellData") ? piece.child("CellData") : piece.append_child("CellData"), "Float64",
              array);
  std::ostringstream text;
  document.save(text, " ");
  return text.str();
}

}  // namespace diastole
