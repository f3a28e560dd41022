"""Grids that `diastole solve` writes, opened by meshio, and grids that meshio writes, read by `diastole mesh`.

usage: other_labs.py DIASTOLE SOURCE_FOLDER. Exit code 77, the reason on standard output: not tried."""

import csv
import json
import pathlib
import subprocess
import sys
import tempfile
import xml.etree.ElementTree as xml

try:
    import meshio
    import numpy as np
except ImportError as missing:
    print(f"skipped: {missing}; install python3-meshio")
    sys.exit(77)

DIASTOLE, SOURCE = sys.argv[1], pathlib.Path(sys.argv[2])


def said(*arguments):
    ended = subprocess.run([DIASTOLE, *map(str, arguments), "--json"], capture_output=True, text=True)
    assert ended.returncode == 0, f"diastole {arguments}: exit code {ended.returncode}\n{ended.stderr}"
    return json.loads(ended.stdout)


def rows_of(path):
    with open(path) as file:
        return [{name: float(value) for name, value in row.items()} for row in csv.DictReader(file)]


def volumes(points, cells):
    """Of hexahedra and wedges, by their middle's Jacobian: positive where corners are in the right order."""
    place = points[cells]
    if cells.shape[1] == 8:
        bottom, top = place[:, :4], place[:, 4:]
        x = (place[:, [1, 2, 5, 6]] - place[:, [0, 3, 4, 7]]).mean(1)
        y = (place[:, [3, 2, 7, 6]] - place[:, [0, 1, 4, 5]]).mean(1)
        return np.einsum("ij,ij->i", np.cross(x, y), (top - bottom).mean(1))
    up = (place[:, 3:] - place[:, :3]).mean(1)
    middle = (place[:, :3] + place[:, 3:]) / 2
    return np.einsum("ij,ij->i", np.cross(middle[:, 1] - middle[:, 0], middle[:, 2] - middle[:, 0]), up) / 2


def the_gel(folder):
    gel = SOURCE / "examples/phantom-a.study.toml"
    vtu, feb, one = folder / "gel.vtu", folder / "gel.feb", folder / "one.xdmf"
    solved = said("solve", gel, "--mesh", "6,2,1", "--pressure-kPa", 3.1, "--probe", "22.5,0,0", "-o", vtu, "-o", feb, "-o", one,
                  "--cells", "3,4,3")
    mesh = meshio.read(vtu)
    (block,) = mesh.cells
    assert block.type == "hexahedron" and len(block.data) == 12 * 36
    each = volumes(mesh.points, block.data)
    whole = 9 * np.sin(2 * np.pi / 18) * (50**2 - 22.5**2) * 85  # of 18 corners around
    assert each.min() > 0 and abs(each.sum() / whole - 1) < 1e-3, (each.min(), each.sum() / whole)
    assert len(mesh.points) == 18 * 9 * 4, "points that elements share are one"
    at = np.argmin(np.linalg.norm(mesh.points - [22.5, 0, 0], axis=1))
    assert np.allclose(mesh.point_data["displacement_mm"][at], solved["probes"][0]["displacement_mm"], atol=1e-9)
    named = solved["probes"][0]["fields"]["strain_cc"]
    assert abs(mesh.point_data["strain_cc"][at] / named - 1) < 0.05, (mesh.point_data["strain_cc"][at], named)

    document = xml.parse(feb).getroot()
    assert document.tag == "febio_spec" and document.get("version") == "4.0"
    nodes = np.array([[float(x) for x in node.text.split(",")] for node in document.find("Mesh/Nodes")])
    assert np.array_equal(nodes, mesh.points)
    material = document.find("Material/material")
    assert material.get("type") == "Mooney-Rivlin" and float(material.find("c1").text) == solved["parameters"]["C1_kPa"]
    held = np.array([int(n) for n in document.find("Mesh/NodeSet").text.split(",")]) - 1
    assert np.allclose(np.abs(nodes[held, 2]), 42.5) and len(held) == 2 * 18 * 4
    for face in document.find("Mesh/Surface"):
        corner = nodes[[int(n) - 1 for n in face.text.split(",")]]
        normal = np.cross(corner[1] - corner[0], corner[2] - corner[0])
        assert normal[:2] @ corner[:, :2].mean(0) < 0, "out of the material, into the cavity"
    assert [point.text for point in document.iter("pt")] == ["0,0", "1,3.1"]

    series = folder / "gel.xdmf"
    said("solve", gel, "--mesh", "6,2,1", "--frames", "-o", series, "--cells", "2,2,2")
    with meshio.xdmf.TimeSeriesReader(series) as reader:
        points, cells = reader.read_points_cells()
        assert cells[0].type == "hexahedron" and reader.num_steps == len(rows_of(SOURCE / "examples/phantom-a.frames.csv"))
        for step in range(reader.num_steps):
            time_s, fields, _ = reader.read_data(step)
            assert fields["displacement_mm"].shape == points.shape
    written = said("mesh", "points", series, "--sigma-mm", 0.2, "-o", folder / "a.points.csv", "--frames", folder / "a.frames.csv")
    assert written["nodes"] == len(points)
    last = [row for row in rows_of(folder / "a.points.csv") if row["frame"] == reader.num_steps - 1]
    moved = np.array([[row[f"{a}_mm"] - row[f"{a.upper()}_mm"] for a in "xyz"] for row in last])
    assert np.allclose(moved, fields["displacement_mm"], atol=1e-9)
    ours = [row["pressure_kPa"] for row in rows_of(folder / "a.frames.csv")]
    assert np.allclose(ours, [row["pressure_kPa"] for row in rows_of(SOURCE / "examples/phantom-a.frames.csv")])


def the_ventricle(folder):
    feb, vtu = folder / "heart.feb", folder / "heart.vtu"
    said("solve", SOURCE / "examples/lv-clean.study.toml", "--mesh", "6,3,1", "--pressure-kPa", 0.4, "-o", feb, "-o", vtu,
         "--cells", "2,2,2")
    mesh = meshio.read(vtu)
    assert {block.type for block in mesh.cells} == {"hexahedron", "wedge"}
    for block in mesh.cells:
        assert volumes(mesh.points, block.data).min() > 0, (block.type, volumes(mesh.points, block.data))
    document = xml.parse(feb).getroot()
    material = {child.tag: float(child.text) for child in document.find("Material/material")}
    assert material["E1"] == material["c"] * 26.7 and material["G12"] == material["c"] * 14.7 / 2
    axes = document.findall("MeshData/ElementData/elem")
    assert len(axes) == 12 * 6 * 2
    for element in axes:
        a, d = (np.array([float(x) for x in element.find(tag).text.split(",")]) for tag in "ad")
        assert abs(a @ a - 1) < 1e-9 and abs(a @ d) < 1e-9
    stiff = folder / "stiff.study.toml"
    stiff.write_text((SOURCE / "examples/phantom-a.study.toml").read_text().split("[law]")[0] + """[law]
name = "demiray"
[law.parameters.C1_kPa]
start = 6.0
bounds = [1.0, 15.0]
[law.parameters.beta]
start = 1.0
bounds = [0.1, 15.0]
""")
    refused = subprocess.run([DIASTOLE, "solve", stiff, "--mesh", "4,2,1", "--pressure-kPa", "0.1", "-o", folder / "stiff.feb"],
                             capture_output=True, text=True)
    assert refused.returncode == 2 and "FEBio has no law that is demiray" in refused.stderr, refused
    assert not (folder / "stiff.feb").exists()


def their_grids(folder):
    """The same two hexahedra by meshio in each format and encoding."""
    points = np.array([[x, y, z] for z in (0.0, 1, 2) for y in (0.0, 1) for x in (0.0, 1)])
    cells = [("hexahedron", np.array([[0, 1, 3, 2, 4, 5, 7, 6], [4, 5, 7, 6, 8, 9, 11, 10]])),
             ("quad", np.array([[0, 2, 3, 1], [8, 9, 11, 10]]))]
    u = 0.1 * points[:, ::-1] + 0.01
    mesh = meshio.Mesh(points, cells, point_data={"u": u}, cell_data={"physical": [np.array([0, 0]), np.array([3, 4])]})
    tries = [("binary.vtu", {}), ("plain.vtu", {"compression": None}), ("ascii.vtu", {"binary": False}), ("theirs.xdmf", {}),
             ("inline.xdmf", {"data_format": "XML"})]
    for name, options in tries:
        meshio.write(folder / name, mesh, **options)
        said("mesh", "points", folder / name, "--sigma-mm", 0.2, "--unit", "cm", "-o", folder / "t.points.csv", "--force")
        rows = rows_of(folder / "t.points.csv")
        found = np.array([[row[f"{a}_mm"] for a in "xyz"] for row in rows])
        assert np.allclose(found, 10 * (points + u), atol=1e-12), name
        said("mesh", "surface", folder / name, "--endo", 3, "--epi", 4, "--sigma-mm", 0.5, "-o", folder / "t.guide.csv", "--force")
        with open(folder / "t.guide.csv") as file:
            surfaces = [row["surface"] for row in csv.DictReader(file)]
        assert surfaces == ["endo"] * 4 + ["epi"] * 4, name
    mesh = meshio.Mesh(points, cells[:1], point_data={"u": u})
    for version in ("gmsh22", "gmsh"):
        meshio.write(folder / "theirs.msh", mesh, file_format=version, binary=False)
        said("mesh", "points", folder / "theirs.msh", "--sigma-mm", 0.2, "-o", folder / "t.points.csv", "--force")
        rows = rows_of(folder / "t.points.csv")
        assert np.allclose([[row[f"{a}_mm"] for a in "xyz"] for row in rows], points + u, atol=1e-12), version


def their_walls(folder):
    """An ellipsoid's walls in their file become our mesh, with the cavity's true volume."""
    points, tags = [], []
    for tag, across, along in ((1, 21, 51), (2, 30, 60)):
        for z in np.linspace(-0.97 * along, 14.5, 14):
            radius = across * np.sqrt(1 - (z / along) ** 2)
            points += [(radius * np.cos(t), radius * np.sin(t), z) for t in np.linspace(0, 2 * np.pi, 16, endpoint=False)]
            tags += [tag] * 16
    points += [(24 * np.cos(t), 24 * np.sin(t), 15) for t in np.linspace(0, 2 * np.pi, 12, endpoint=False)]
    tags += [3] * 12
    cells = [("vertex", np.arange(len(points))[:, None])]
    meshio.write(folder / "walls.vtu", meshio.Mesh(np.array(points), cells, cell_data={"physical": [np.array(tags)]}))
    said("mesh", "surface", folder / "walls.vtu", "--endo", 1, "--epi", 2, "--base", 3, "--sigma-mm", 0.2, "-o", folder / "walls.guide.csv")
    fitted = said("lv", folder / "walls.guide.csv", "--keep-slices", "-o", folder / "walls.mesh.toml")
    true_mL = np.pi * 21**2 * ((15 + 51) - (15**3 + 51**3) / (3 * 51**2)) / 1000
    assert abs(fitted["cavity_mL"] / true_mL - 1) < 0.002, (fitted["cavity_mL"], true_mL)


with tempfile.TemporaryDirectory() as scratch:
    for task in (the_gel, the_ventricle, their_grids, their_walls):
        task(pathlib.Path(scratch))
        print(f"{task.__name__}: passed")
