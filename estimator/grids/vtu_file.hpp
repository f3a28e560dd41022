#pragma once
// VTK's unstructured grids (.vtu): https://docs.vtk.org/en/latest/vtk_file_formats/vtkxml_file_format.html
// Read are one piece, little-endian, as ASCII, base64 or appended (raw or base64), whole or compressed by zlib. Written as ASCII, every
// number to the last bit.

#include <filesystem>
#include <string>

#include "estimator/grids/field_grid.hpp"

namespace diastole {

/// The time is that of the field data TimeValue, 0 without. Throws InputError with the array for whatever is wrong in it.
FieldGrid read_vtu(const std::string& path);

/// One step of the grid as a file's text.
std::string vtu_text(const FieldGrid& grid, const GridStep& step);

}  // namespace diastole
