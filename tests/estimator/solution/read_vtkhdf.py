"""Reads a .vtkhdf file with other people's software and compares places and fields with a list of samples.

    read_vtkhdf.py h5py GRID.vtkhdf SAMPLES.json     by the letter of the VTKHDF specification
    read_vtkhdf.py vtk  GRID.vtkhdf SAMPLES.json     by VTK's own reader and its Bezier hexahedra

A sample: {"step": 0, "element": 3, "xi": [..], "arrays": {"": place_mm, "displacement_mm": [..], ...}}.
Prints the largest difference; ends with 1 if it exceeds 1e-9 and with 77 if the software is absent.
"""

import json
import math
import sys

# vtkHigherOrderHexahedron::PointIndexFromIJK(i, j, k, (3, 3, 3)) for k, j, i counting up, as VTK 9.1 prints it.
VTK_ORDER = [
    0, 8, 9, 1, 14, 48, 49, 10, 15, 50, 51, 11, 3, 12, 13, 2,
    24, 40, 41, 26, 32, 56, 57, 36, 33, 58, 59, 37, 30, 44, 45, 28,
    25, 42, 43, 27, 34, 60, 61, 38, 35, 62, 63, 39, 31, 46, 47, 29,
    4, 16, 17, 5, 22, 52, 53, 18, 23, 54, 55, 19, 7, 20, 21, 6]


def bernstein(xi):
    return [math.comb(3, i) * xi**i * (1 - xi) ** (3 - i) for i in range(4)]


def weights_of(xi):
    b = [bernstein(v) for v in xi]
    weights = [0.0] * 64
    for k in range(4):
        for j in range(4):
            for i in range(4):
                weights[VTK_ORDER[i + 4 * j + 16 * k]] = b[0][i] * b[1][j] * b[2][k]
    return weights


class SpecificationReader:
    def __init__(self, path):
        import h5py

        self.root = h5py.File(path, "r")["VTKHDF"]
        assert self.root.attrs["Type"] == b"UnstructuredGrid"
        assert self.root.attrs.get_id("Type").get_type().get_cset() == h5py.h5t.CSET_ASCII
        self.steps = self.root.get("Steps")
        assert list(self.root.attrs["Version"]) == [2 if self.steps else 1, 0]
        assert len(self.root["NumberOfPoints"]) == len(self.root["NumberOfCells"]) == 1
        cells = self.root["NumberOfCells"][0]
        assert self.root["NumberOfConnectivityIds"][0] == len(self.root["Connectivity"])
        assert len(self.root["Points"]) == self.root["NumberOfPoints"][0]
        assert len(self.root["Offsets"]) == cells + 1 and len(self.root["Types"]) == cells
        assert self.root["Types"].dtype == "uint8" and set(self.root["Types"][:]) == {79}
        assert (self.root["CellData/HigherOrderDegrees"][:] == 3).all()
        if self.steps:
            count = self.steps.attrs["NSteps"]
            for name in ("Values", "PartOffsets", "NumberOfParts", "PointOffsets"):
                assert self.steps[name].shape == (count,), name
            for name in ("CellOffsets", "ConnectivityIdOffsets"):
                assert self.steps[name].shape == (count, 1), name

    def start(self, step, group, name):
        return self.steps[group + "Offsets/" + name][step] if self.steps else 0

    def values(self, step, element, name):
        begin, end = self.root["Offsets"][element : element + 2]
        ids = self.root["Connectivity"][begin:end]
        if name:
            return self.root["PointData/" + name][:][ids + self.start(step, "PointData", name)]
        return self.root["Points"][:][ids + (self.steps["PointOffsets"][step] if self.steps else 0)]

    def pressure_kPa(self, step):
        return self.root["FieldData/pressure_kPa"][self.start(step, "FieldData", "pressure_kPa")]

    def at(self, step, element, xi, name):
        return list((self.values(step, element, name).T @ weights_of(xi)).reshape(-1))


class VtkReader:
    def __init__(self, path):
        import vtk

        self.vtk = vtk
        reader = vtk.vtkHDFReader()
        reader.SetFileName(path)
        reader.Update()
        self.grid = reader.GetOutput()
        assert self.grid.GetNumberOfCells() > 0

    def pressure_kPa(self, step):
        return self.grid.GetFieldData().GetArray("pressure_kPa").GetValue(0)

    def at(self, step, element, xi, name):
        cell = self.grid.GetCell(element)
        assert cell.GetClassName() == "vtkBezierHexahedron"
        place, weights = [0.0] * 3, [0.0] * 64
        cell.EvaluateLocation(self.vtk.reference(0), xi, place, weights)
        if not name:
            return place
        array = self.grid.GetPointData().GetArray(name)
        total = [0.0] * array.GetNumberOfComponents()
        for i, weight in enumerate(weights):
            for j, value in enumerate(array.GetTuple(cell.GetPointId(i))):
                total[j] += weight * value
        return total


def main():
    kind, grid, samples = sys.argv[1:]
    try:
        reader = {"h5py": SpecificationReader, "vtk": VtkReader}[kind](grid)
    except ModuleNotFoundError as absent:
        print(absent)
        sys.exit(77)
    largest = 0.0
    for sample in json.load(open(samples)):
        assert abs(reader.pressure_kPa(sample["step"]) - sample["pressure_kPa"]) < 1e-12
        for name, expected in sample["arrays"].items():
            found = reader.at(sample["step"], sample["element"], sample["xi"], name)
            assert len(found) == len(expected), name
            difference = max(abs(a - b) for a, b in zip(found, expected))
            if difference > 1e-9:
                print(name or "place", sample["element"], sample["xi"], found, expected)
            largest = max(largest, difference)
    print("largest difference", largest)
    sys.exit(0 if largest < 1e-9 else 1)


main()
