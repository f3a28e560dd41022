#pragma once
// Gmsh meshes (.msh), format 2.2 or 4.1, ASCII: $MeshFormat, $PhysicalNames, $Nodes, $Elements and $NodeData, whose time steps become
// the grid's. https://gmsh.info/doc/texinfo/gmsh.html#MSH-file-format

#include <string>

#include "estimator/grids/field_grid.hpp"

namespace diastole {

/// Cell data `physical`: the physical group of each cell, 0 for none. Throws InputError with the line for binary files, other
/// versions, and whatever is wrong in it.
FieldGrid read_gmsh(const std::string& path);

}  // namespace diastole
