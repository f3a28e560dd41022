#include "estimator/grids/xdmf_file.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <pugixml.hpp>
#include <sstream>
#include <stdexcept>

#include "estimator/grids/vtu_data.hpp"
#include "estimator/io/whole_file.hpp"
#include "protocol/contract/input_error.hpp"
#include "protocol/contract/text.hpp"
#include "protocol/runfile/h5_source.hpp"

namespace diastole {
namespace {

using runfile::DatasetHandle;
using runfile::FileHandle;
using runfile::SpaceHandle;

class XdmfReader {
 public:
  explicit XdmfReader(const std::string& path) : file_(path) {
    const std::string text = read_whole_file(path);
    const pugi::xml_parse_result parsed = document_.load_buffer(text.data(), text.size());
    if (!parsed) refuse(fmt::format("byte {}", parsed.offset), parsed.description());
  }

  FieldGrid read() {
    const pugi::xml_node outermost = document_.child("Xdmf").child("Domain").child("Grid");
    if (!outermost) refuse("", "has no Grid in a Domain");
    std::vector<pugi::xml_node> steps;
    if (std::string_view(outermost.attribute("GridType").as_string("Uniform")) == "Collection") {
      if (std::string_view(outermost.attribute("CollectionType").as_string()) != "Temporal")
        refuse("Grid", "is a collection in space");
      for (const pugi::xml_node& grid : outermost.children("Grid"))
        steps.push_back(grid);
    } else {
      steps.push_back(outermost);
    }
    FieldGrid grid;
    // meshio keeps points and cells of a series in a grid of their own.
    pugi::xml_node first = document_.child("Xdmf").child("Domain").find_node(
        [](const pugi::xml_node& node) { return std::string_view(node.name()) == "Topology"; });
    if (!first || steps.empty()) refuse("Grid", "has no Topology");
    const pugi::xml_node shape = first.parent();
    read_geometry(shape.child("Geometry"), grid);
    read_topology(first, grid);
    for (const pugi::xml_node& step : steps)
      read_step(step, grid);
    return grid;
  }

 private:
  [[noreturn]] void refuse(std::string place, std::string problem) const {
    throw InputError({file_, std::move(place), std::move(problem),
                      "Export it again as XDMF 3 (with its .h5 file beside it); meshio writes it."});
  }

  std::vector<double> numbers(const pugi::xml_node& item, const std::string& place) {
    if (!item) refuse(place, "has no DataItem");
    const std::string_view format = item.attribute("Format").as_string("XML");
    const std::string text(trimmed(item.text().as_string()));
    if (format == "XML") {
      try {
        return numbers_of_text(text);
      } catch (const std::invalid_argument& error) {
        refuse(place, error.what());
      }
    }
    if (format != "HDF") refuse(place, fmt::format("the format \"{}\" is not read", format));
    const size_t colon = text.find(':');
    if (colon == std::string::npos) refuse(place, fmt::format("\"{}\" is not FILE.h5:/dataset", text));
    return dataset(text.substr(0, colon), text.substr(colon + 1), place);
  }

  std::vector<double> dataset(const std::string& name, const std::string& path, const std::string& place) {
    const std::filesystem::path beside = std::filesystem::path(file_).parent_path() / name;
    try {
      return beside_.try_emplace(beside.lexically_normal(), beside).first->second.field(path);
    } catch (const InputError& error) {
      const InputFault& fault = error.fault();
      refuse(place, fmt::format("{}{}: {}", fault.file, fault.place.empty() ? "" : ", " + fault.place,
                                fault.problem));
    }
  }

  void read_geometry(const pugi::xml_node& node, FieldGrid& grid) {
    const std::string_view type = node.attribute("GeometryType") ? node.attribute("GeometryType").as_string()
                                                                 : node.attribute("Type").as_string("XYZ");
    if (type != "XYZ") refuse("Geometry", fmt::format("is of type {}, not XYZ", type));
    grid.points = numbers(node.child("DataItem"), "Geometry");
  }

  void read_topology(const pugi::xml_node& node, FieldGrid& grid) {
    const std::string type = node.attribute("TopologyType") ? node.attribute("TopologyType").as_string()
                                                            : node.attribute("Type").as_string();
    const std::vector<double> data = numbers(node.child("DataItem"), "Topology");
    const auto lower = [](std::string text) {
      std::ranges::transform(text, text.begin(),
                             [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c + 32) : c; });
      return text;
    };
    const bool mixed = lower(type) == "mixed";
    const auto named = std::ranges::find_if(
        cell_kinds(), [&](const CellKind& kind) { return lower(kind.xdmf_name) == lower(type); });
    if (!mixed && named == cell_kinds().end())
      refuse("Topology", fmt::format("cells of type {} are not known", type));
    for (size_t at = 0; at < data.size();) {
      const std::string place = fmt::format("Topology, cell {}", grid.cells.size());
      auto kind = named;
      if (mixed) {
        kind = std::ranges::find_if(cell_kinds(), [&](const CellKind& one) { return one.xdmf == data[at]; });
        if (kind == cell_kinds().end())
          refuse(place, fmt::format("cells of type {} are not known", data[at]));
        at += kind->xdmf <= 2 ? 2 : 1;  // points and lines say how many there are
      }
      if (at + kind->points > data.size()) refuse(place, "has too few points");
      GridCell& cell = grid.cells.emplace_back(GridCell{kind->shape, {}});
      for (size_t i = 0; i < corner_count(kind->shape); ++i) {
        if (!(data[at + i] >= 0)) refuse(place, fmt::format("names point {}", data[at + i]));
        cell.points.push_back(static_cast<size_t>(data[at + i]));
      }
      at += kind->points;
    }
  }

  void read_step(const pugi::xml_node& node, FieldGrid& grid) {
    GridStep step;
    step.time_s = node.child("Time").attribute("Value").as_double(0.0);
    for (const pugi::xml_node& single : node.children("Information")) {
      try {
        const std::vector<double> values = numbers_of_text(single.attribute("Value").as_string());
        if (values.size() == 1) step.field_data.push_back({single.attribute("Name").as_string(), 1, values});
      } catch (const std::invalid_argument&) {  // words, which nobody asked for
      }
    }
    for (const pugi::xml_node& attribute : node.children("Attribute")) {
      const std::string name = attribute.attribute("Name").as_string();
      const std::string_view centre = attribute.attribute("Center").as_string("Node");
      const std::string place = fmt::format("Attribute {}", name);
      GridArray array{name, 1, numbers(attribute.child("DataItem"), place)};
      const size_t rows = centre == "Node" ? grid.point_count() : centre == "Cell" ? grid.cells.size() : 1;
      if (rows == 0 || array.values.size() % rows != 0)
        refuse(place, fmt::format("has {} numbers for {} of Center {}", array.values.size(), rows, centre));
      array.components = array.values.size() / rows;
      if (centre == "Node")
        step.point_data.push_back(std::move(array));
      else if (centre == "Cell" && grid.steps.empty())
        grid.cell_data.push_back(std::move(array));
      else if (centre == "Grid" && array.components == 1)
        step.field_data.push_back(std::move(array));
    }
    grid.steps.push_back(std::move(step));
  }

  std::string file_;
  pugi::xml_document document_;
  std::map<std::filesystem::path, runfile::H5Source> beside_;  ///< each bounds what is read of it in all
};

/// The XML and the datasets that it names.
class XdmfWriter {
 public:
  XdmfWriter(const std::filesystem::path& numbers, const std::filesystem::path& temporary)
      : name_(numbers.string()),
        beside_(numbers.filename().string()),
        file_(H5Fcreate(temporary.c_str(), H5F_ACC_TRUNC, H5P_DEFAULT, H5P_DEFAULT)) {
    must(file_.valid());
  }

  void item(pugi::xml_node parent, const std::string& path, const GridArray& array,
            bool whole_numbers = false) {
    std::vector<hsize_t> shape{array.values.size() / array.components};
    if (array.components > 1) shape.push_back(array.components);
    const SpaceHandle space(H5Screate_simple(static_cast<int>(shape.size()), shape.data(), nullptr));
    const DatasetHandle set =
        runfile::create_dataset(file_.get(), path, whole_numbers ? H5T_STD_I64LE : H5T_IEEE_F64LE, space);
    must(set.valid() &&
         H5Dwrite(set.get(), H5T_NATIVE_DOUBLE, H5S_ALL, H5S_ALL, H5P_DEFAULT, array.values.data()) >= 0);
    pugi::xml_node node = parent.append_child("DataItem");
    node.append_attribute("Dimensions") = fmt::format("{}", fmt::join(shape, " ")).c_str();
    node.append_attribute("NumberType") = whole_numbers ? "Int" : "Float";
    node.append_attribute("Precision") = 8;
    node.append_attribute("Format") = "HDF";
    node.text() = fmt::format("{}:{}", beside_, path).c_str();
  }
  void attribute(pugi::xml_node grid, const std::string& path, const GridArray& array, const char* centre) {
    pugi::xml_node node = grid.append_child("Attribute");
    node.append_attribute("Name") = array.name.c_str();
    node.append_attribute("AttributeType") = array.components == 1   ? "Scalar"
                                             : array.components == 3 ? "Vector"
                                             : array.components == 6 ? "Tensor6"
                                             : array.components == 9 ? "Tensor"
                                                                     : "Matrix";
    node.append_attribute("Center") = centre;
    item(node, path, array);
  }
  void close() {
    must(H5Fflush(file_.get(), H5F_SCOPE_GLOBAL) >= 0);
    file_ = FileHandle();
  }

 private:
  void must(bool done) const {
    if (done) return;
    throw InputError({name_, "", "the file cannot be written",
                      "Check the folder, that you may write there, and the space on the disk."});
  }
  std::string name_, beside_;
  FileHandle file_;
};

/// Mixed cells: each its type, then its points.
GridArray topology_of(const FieldGrid& grid) {
  GridArray topology{"topology", 1, {}};
  for (const GridCell& cell : grid.cells) {
    const auto kind = std::ranges::find(cell_kinds(), cell.shape, &CellKind::shape);
    topology.values.push_back(kind->xdmf);
    if (kind->xdmf <= 2) topology.values.push_back(static_cast<double>(cell.points.size()));
    topology.values.insert(topology.values.end(), cell.points.begin(), cell.points.end());
  }
  return topology;
}

void fill(pugi::xml_document& document, XdmfWriter& writer, const FieldGrid& grid) {
  pugi::xml_node root = document.append_child("Xdmf");
  root.append_attribute("Version") = "3.0";
  pugi::xml_node parent = root.append_child("Domain");
  parent = parent.append_child("Grid");
  parent.append_attribute("Name") = "solution";
  parent.append_attribute("GridType") = "Collection";
  parent.append_attribute("CollectionType") = "Temporal";
  for (size_t s = 0; s < grid.steps.size(); ++s) {
    const GridStep& step = grid.steps[s];
    pugi::xml_node node = parent.append_child("Grid");
    node.append_attribute("Name") = "solution";
    node.append_attribute("GridType") = "Uniform";
    node.append_child("Time").append_attribute("Value") = step.time_s;
    pugi::xml_node topology = node.append_child("Topology"), geometry = node.append_child("Geometry");
    topology.append_attribute("TopologyType") = "Mixed";
    topology.append_attribute("NumberOfElements") = static_cast<unsigned long long>(grid.cells.size());
    geometry.append_attribute("GeometryType") = "XYZ";
    if (s == 0) {
      writer.item(topology, "/topology", topology_of(grid), true);
      writer.item(geometry, "/points", {"points", 3, grid.points});
    } else {
      const pugi::xml_node first = parent.child("Grid");
      topology.append_copy(first.child("Topology").child("DataItem"));
      geometry.append_copy(first.child("Geometry").child("DataItem"));
    }
    for (const GridArray& array : step.point_data)
      writer.attribute(node, fmt::format("/step{}/{}", s, array.name), array, "Node");
    for (const GridArray& array : grid.cell_data) {
      if (s == 0) writer.attribute(node, "/cells/" + array.name, array, "Cell");
    }
    for (const GridArray& array : step.field_data) {
      pugi::xml_node single = node.append_child("Information");
      single.append_attribute("Name") = array.name.c_str();
      single.append_attribute("Value") = fmt::format("{}", array.values.front()).c_str();
    }
  }
}

}  // namespace

std::filesystem::path numbers_beside(const std::filesystem::path& path) {
  return std::filesystem::path(path).replace_extension(".h5");
}

FieldGrid read_xdmf(const std::string& path) {
  FieldGrid grid = XdmfReader(path).read();
  require_sound(grid, path);
  return grid;
}

void write_xdmf(const std::filesystem::path& path, const FieldGrid& grid) {
  const std::filesystem::path numbers = numbers_beside(path);
  pugi::xml_document document;
  write_whole_file(numbers, [&](const std::filesystem::path& unfinished) {
    XdmfWriter writer(numbers, unfinished);
    fill(document, writer, grid);
    writer.close();
  });
  std::ostringstream text;
  document.save(text, " ");
  write_whole_file(path, text.str());
}

}  // namespace diastole
