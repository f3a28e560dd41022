// Other laboratories' grids: each format by a file drawn by hand, and there and back where we write it.

#include <gmock/gmock.h>

#include "estimator/grids/displaced_points.hpp"
#include "estimator/grids/gmsh_file.hpp"
#include "estimator/grids/vtu_file.hpp"
#include "estimator/grids/xdmf_file.hpp"
#include "estimator/io/whole_file.hpp"
#include "tests/estimator/io/scratch_file.hpp"

namespace diastole {
namespace {

using test::message_of;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;

// A tetrahedron with a triangle on its face z = 0, the triangle being of the physical group 7, "inside".
constexpr const char* gmsh_2 =
    "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 7 \"inside\"\n$EndPhysicalNames\n"
    "$Nodes\n4\n10 0 0 0\n20 1 0 0\n30 0 1 0\n40 0 0 1e0\n$EndNodes\n"
    "$Elements\n2\n1 2 2 7 1 10 20 30\n2 4 2 0 1 10 20 30 40\n$EndElements\n"
    "$NodeData\n1\n\"u\"\n1\n0.5\n3\n0\n3\n4\n10 0 0 0\n20 0.1 0 0\n30 0 0 0\n40 0 0 0.2\n$EndNodeData\n"
    "$NodeData\n1\n\"u\"\n1\n1.0\n3\n1\n3\n4\n10 0 0 0\n20 0.2 0 0\n30 0 0 0\n40 0 0 0.4\n$EndNodeData\n";
constexpr const char* gmsh_4 =
    "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$PhysicalNames\n1\n2 7 \"inside\"\n$EndPhysicalNames\n"
    "$Entities\n0 0 1 1\n1 0 0 0 1 1 0 1 7 0\n1 0 0 0 1 1 1 0 1 1\n$EndEntities\n"
    "$Nodes\n2 4 10 40\n2 1 0 3\n10\n20\n30\n0 0 0\n1 0 0\n0 1 0\n3 1 0 1\n40\n0 0 1\n$EndNodes\n"
    "$Elements\n2 2 1 2\n2 1 2 1\n1 10 20 30\n3 1 4 1\n2 10 20 30 40\n$EndElements\n";

void expect_tetrahedron(const FieldGrid& grid) {
  EXPECT_THAT(grid.points, ElementsAre(0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1));
  ASSERT_EQ(grid.cells.size(), 2U);
  EXPECT_EQ(grid.cells[0].shape, CellShape::triangle);
  EXPECT_THAT(grid.cells[1].points, ElementsAre(0, 1, 2, 3));
  ASSERT_EQ(grid.cell_data.size(), 1U);
  EXPECT_THAT(grid.cell_data[0].values, ElementsAre(7, 0));
  EXPECT_EQ(grid.tag_names.at("inside"), 7);
  EXPECT_EQ(outer_faces(grid).size(), 4U);
}

TEST(Grids, GmshOfBothVersions) {
  const test::ScratchFolder folder;
  const FieldGrid old = read_grid(folder.write("old.msh", gmsh_2).string());
  expect_tetrahedron(old);
  ASSERT_EQ(old.steps.size(), 2U);
  EXPECT_EQ(old.steps[1].time_s, 1.0);
  EXPECT_EQ(old.steps[1].point_data[0].values[11], 0.4);
  expect_tetrahedron(read_grid(folder.write("new.msh", gmsh_4).string()));
}

TEST(Grids, GmshErrorsHaveTheirLine) {
  const test::ScratchFolder folder;
  const auto message = [&](std::string text, const std::string& from, const std::string& to) {
    text.replace(text.find(from), from.size(), to);
    const std::string file = folder.write("bad.msh", text).string();
    return message_of([&] { (void)read_grid(file); });
  };
  EXPECT_THAT(message(gmsh_2, "2.2 0 8", "2.2 1 8"), AllOf(HasSubstr("line 2"), HasSubstr("binary")));
  EXPECT_THAT(message(gmsh_2, "2.2 0", "3.0 0"), HasSubstr("version 3.0"));
  EXPECT_THAT(message(gmsh_2, "1 2 2 7 1 10 20 30", "1 2 2 7 1 10 20 31"),
              AllOf(HasSubstr("line 17"), HasSubstr("node 31")));
  EXPECT_THAT(message(gmsh_2, "1e0", "nan"), HasSubstr("not finite"));
  EXPECT_THAT(message(gmsh_2, "40 0 0 1e0", "40 0 x 1e0"), HasSubstr("\"x\" is no number"));
  EXPECT_THAT(message(gmsh_2, "$Nodes\n4", "$Nodes\n5"), HasSubstr("no number"));
  EXPECT_THAT(message(gmsh_2, "4 2 0 1 10 20 30 40", "99 2 0 1 10 20 30 40"), HasSubstr("type 99"));
  EXPECT_THAT(message_of([&] { (void)read_grid("a.stl"); }), HasSubstr("meshio"));
}

TEST(Grids, DisplacementsBecomePoints) {
  const test::ScratchFolder folder;
  const FieldGrid grid = read_grid(folder.write("a.msh", gmsh_2).string());
  const DisplacedPoints points = displaced_points(grid, {"", 10, 0.3}, "a.msh");
  EXPECT_EQ(points.frames, 2U);
  EXPECT_EQ(points.points, 4U);
  EXPECT_TRUE(points.frames_csv.empty());
  EXPECT_THAT(points.points_csv,
              AllOf(HasSubstr("\n1,10,0,0,11,0,0,0.3\n"), HasSubstr("\n2,0,0,10,0,0,14,0.3\n")));
  EXPECT_THAT(message_of([&] { (void)displaced_points(grid, {"v", 1, 1}, "a.msh"); }), HasSubstr("u (3)"));
}

TEST(Grids, SurfacesBecomeGuidePoints) {
  const test::ScratchFolder folder;
  const FieldGrid grid = read_grid(folder.write("a.msh", gmsh_4).string());
  const SurfacePoints points =
      surface_points(grid, "physical", {{"endo", "inside"}, {"base", "7"}}, 1.0, 0.5, "a.msh");
  EXPECT_THAT(points.points, ElementsAre(3, 3));
  EXPECT_THAT(points.guide_csv,
              AllOf(HasSubstr("\n0,grid,endo,0,1,0,0.5\n"), HasSubstr("\n0,grid,base,1,0,0,0.5\n")));
  EXPECT_THAT(message_of([&] {
                (void)surface_points(grid, "physical", {{"endo", "outside"}}, 1, 1, "a.msh");
              }),
              HasSubstr("The file's names: inside"));
  EXPECT_THAT(message_of([&] {
                (void)surface_points(grid, "physical", {{"endo", "3"}}, 1, 1, "a.msh");
              }),
              HasSubstr("no cell has physical = 3"));
}

/// Two wedges on a hexahedron, with fields at two times.
FieldGrid some_grid() {
  FieldGrid grid;
  for (size_t i = 0; i < 10; ++i)
    for (const double x : {i % 2 ? 1.0 : 0.0, i / 2 % 2 ? 1.0 : 0.0, 0.1 + static_cast<double>(i / 4) / 3.0})
      grid.points.push_back(x);
  grid.cells = {{CellShape::hexahedron, {0, 1, 3, 2, 4, 5, 7, 6}}, {CellShape::wedge, {4, 5, 8, 6, 7, 9}}};
  grid.cell_data = {{"element", 1, {0, 1}}};
  for (const double time_s : {0.25, 0.5}) {
    GridStep& step = grid.steps.emplace_back(
        GridStep{time_s, {{"displacement_mm", 3, {}}}, {{"pressure_kPa", 1, {4 * time_s}}}});
    for (size_t i = 0; i < 30; ++i)
      step.point_data[0].values.push_back(time_s / (1.0 + static_cast<double>(i)));
  }
  return grid;
}

void expect_same(const FieldGrid& a, const FieldGrid& b, size_t steps) {
  EXPECT_EQ(a.points, b.points);
  ASSERT_EQ(a.cells.size(), b.cells.size());
  for (size_t c = 0; c < a.cells.size(); ++c) {
    EXPECT_EQ(a.cells[c].shape, b.cells[c].shape);
    EXPECT_EQ(a.cells[c].points, b.cells[c].points);
  }
  ASSERT_EQ(a.cell_data.size(), b.cell_data.size());
  EXPECT_EQ(a.cell_data[0].values, b.cell_data[0].values);
  ASSERT_EQ(b.steps.size(), steps);
  for (size_t s = 0; s < steps; ++s) {
    EXPECT_EQ(a.steps[s].time_s, b.steps[s].time_s);
    EXPECT_EQ(a.steps[s].point_data[0].name, b.steps[s].point_data[0].name);
    EXPECT_EQ(a.steps[s].point_data[0].values, b.steps[s].point_data[0].values);
    ASSERT_EQ(b.steps[s].field_data.size(), 1U);
    EXPECT_EQ(a.steps[s].field_data[0].values, b.steps[s].field_data[0].values);
  }
}

TEST(Grids, VtuThereAndBackToTheLastBit) {
  const test::ScratchFolder folder;
  const FieldGrid grid = some_grid();
  expect_same(grid, read_grid(folder.write("a.vtu", vtu_text(grid, grid.steps[0])).string()), 1);
}

TEST(Grids, XdmfThereAndBackToTheLastBit) {
  const test::ScratchFolder folder;
  const FieldGrid grid = some_grid();
  write_xdmf(folder.path() / "a.xdmf", grid);
  const FieldGrid back = read_grid((folder.path() / "a.xdmf").string());
  expect_same(grid, back, 2);
  EXPECT_THAT(displaced_points(back, {"", 1, 1}, "a.xdmf").frames_csv,
              HasSubstr("\n0,0,0,0\n1,0.25,1,0\n2,0.5,2,0\n"));
  std::filesystem::remove(folder.path() / "a.h5");
  EXPECT_THAT(message_of([&] { (void)read_grid((folder.path() / "a.xdmf").string()); }),
              HasSubstr("a.h5: cannot be opened"));
}

TEST(Grids, XdmfRefusesADatasetThatIsNamedMoreOftenThanMemoryBears) {
  const test::ScratchFolder folder;
  FieldGrid grid = some_grid();
  grid.points.resize(30'000);
  grid.steps.resize(1);
  grid.steps[0].point_data[0].values.resize(30'000);
  const std::string file = (folder.path() / "a.xdmf").string(), end_of_field = "</Attribute>";
  write_xdmf(file, grid);
  std::string text = read_whole_file(file);
  const size_t begin = text.find("<Attribute"), end = text.find(end_of_field) + end_of_field.size();
  const std::string field = text.substr(begin, end - begin);
  for (int i = 0; i < 1800; ++i)  // 432 MB of 0.5 MB
    text.insert(end, field);
  (void)folder.write("a.xdmf", text);
  EXPECT_THAT(message_of([&] { (void)read_grid(file); }),
              HasSubstr("a.h5, dataset /step0/displacement_mm: needs"));
}

std::string vtu_with(const std::string& attributes, const std::string& points,
                     const std::string& appended = "") {
  return "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\" " + attributes +
         "><UnstructuredGrid><Piece NumberOfPoints=\"1\" NumberOfCells=\"1\"><Points>" + points +
         "</Points><Cells><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0</DataArray>"
         "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">1</DataArray>"
         "<DataArray type=\"UInt8\" Name=\"types\" "
         "format=\"ascii\">1</DataArray></Cells></Piece></UnstructuredGrid>" +
         appended + "</VTKFile>";
}

// 1.5, -2, 0.25 as float: 0000c03f 000000c0 0000803e; a length of 12 before them, as UInt32 and as UInt64.
TEST(Grids, VtuInEveryEncoding) {
  const test::ScratchFolder folder;
  const auto read = [&](const std::string& text) {
    return read_grid(folder.write("a.vtu", text).string()).points;
  };
  const auto expected = ElementsAre(1.5, -2.0, 0.25);
  const std::string floats("\x00\x00\xc0\x3f\x00\x00\x00\xc0\x00\x00\x80\x3e", 12), length("\x0c\0\0\0", 4);
  const std::string wide = "header_type=\"UInt64\"";
  EXPECT_THAT(read(vtu_with("", "<DataArray type=\"Float32\" format=\"ascii\">1.5 -2\n0.25</DataArray>")),
              expected);
  EXPECT_THAT(read(vtu_with(
                  "", "<DataArray type=\"Float32\" format=\"binary\">DAAAAAAAwD8AAADAAACAPg==</DataArray>")),
              expected);
  EXPECT_THAT(read(vtu_with(
                  "", "<DataArray type=\"Float32\" format=\"binary\">DAAAAA==AADAPwAAAMAAAIA+</DataArray>")),
              expected);
  EXPECT_THAT(
      read(vtu_with(
          wide, "<DataArray type=\"Float32\" format=\"binary\">DAAAAAAAAAAAAMA/AAAAwAAAgD4=</DataArray>")),
      expected);
  EXPECT_THAT(read(vtu_with("", "<DataArray type=\"Float32\" format=\"appended\" offset=\"2\"/>",
                            "<AppendedData encoding=\"raw\">_zz" + length + floats + "</AppendedData>")),
              expected);
  EXPECT_THAT(
      read(vtu_with("", "<DataArray type=\"Float32\" format=\"appended\" offset=\"4\"/>",
                    "<AppendedData encoding=\"base64\">_abcdDAAAAAAAwD8AAADAAACAPg==AAAA</AppendedData>")),
      expected);
  const auto fails = [&](const std::string& attributes, const std::string& points) {
    return message_of([&] { (void)read(vtu_with(attributes, points)); });
  };
  EXPECT_THAT(fails("", "<DataArray type=\"Float32\" format=\"binary\">DQAAAAAAwD8AAADAAACAPg==</DataArray>"),
              HasSubstr("shorter than their header"));
  EXPECT_THAT(fails("compressor=\"vtkLZ4DataCompressor\"", ""), HasSubstr("vtkLZ4DataCompressor"));
  EXPECT_THAT(fails("", "<DataArray type=\"Float32\" format=\"ascii\">1.5 -2</DataArray>"),
              HasSubstr("2 numbers"));
  EXPECT_THAT(fails("", "<DataArray type=\"Complex\" format=\"binary\">DAAAAAAAwD8AAADAAACAPg==</DataArray>"),
              HasSubstr("Complex"));
  EXPECT_THAT(message_of([&] { (void)read("<VTKFile"); }), HasSubstr("a.vtu: byte"));
}

}  // namespace
}  // namespace diastole
