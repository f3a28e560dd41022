#include "estimator/fe/sparse_factor.hpp"

#include <dmumps_c.h>

#include <cstdio>
// after cstdio: it names FILE
#include <scotch/scotch.h>

#include <mutex>
#include <new>
#include <stdexcept>
#include <string>

namespace diastole {
namespace {

constexpr int initialise = -1;
constexpr int terminate_instance = -2;
constexpr int analyse = 1;
constexpr int factorise_values = 2;
constexpr int back_substitute = 3;

// MUMPS's manual numbers its controls from 1.
int& control(DMUMPS_STRUC_C& mumps, int number) { return mumps.icntl[number - 1]; }
int outcome(const DMUMPS_STRUC_C& mumps, int number) { return mumps.infog[number - 1]; }

}  // namespace

struct SparseFactor::Instance {
  DMUMPS_STRUC_C mumps{};
  bool analysed = false;

  /// MUMPS and SCOTCH keep numbers of their own for the whole process: one thread at a time.
  int run(int job) {
    static std::mutex busy;
    const std::scoped_lock lock(busy);
    if (job == analyse)
      SCOTCH_randomReset();  // else the ordering, and the last bits of solutions, depend on what was solved before
    mumps.job = job;
    dmumps_c(&mumps);
    return outcome(mumps, 1);
  }

  void check(int status) const {
    constexpr int allocation_failed = -13;
    if (status == allocation_failed) throw std::bad_alloc();
    if (status < 0) {
      throw std::runtime_error("MUMPS stopped with code " + std::to_string(status) + ", detail " +
                               std::to_string(outcome(mumps, 2)));
    }
  }
};

SparseFactor::SparseFactor(size_t size, std::span<const int> rows, std::span<const int> columns,
                           MatrixKind kind)
    : instance_(std::make_unique<Instance>()) {
  DMUMPS_STRUC_C& mumps = instance_->mumps;
  constexpr int use_default_communicator = -987654;
  constexpr int unsymmetric = 0;
  constexpr int general_symmetric = 2;
  mumps.comm_fortran = use_default_communicator;
  mumps.par = 1;
  mumps.sym = kind == MatrixKind::symmetric ? general_symmetric : unsymmetric;
  instance_->check(instance_->run(initialise));
  for (const int stream : {1, 2, 3})
    control(mumps, stream) = -1;
  control(mumps, 4) = 0;
  // Found by measurement: minimum fill for small matrices, SCOTCH's dissection for large ones, of the plain graph. Matching
  // large entries to the diagonal beforehand, as MUMPS does by itself, costs more than all it saves, because pivots stay in
  // range without it. Analysis and factorisation, s, one thread:
  //
  //                      1,792 unknowns    9,728 unknowns
  //   by itself          0.059 + 0.037     0.44 + 1.71
  //   SCOTCH             0.005 + 0.036     0.04 + 1.15
  //   minimum fill       0.003 + 0.029     0.03 + 1.78
  constexpr int approximate_minimum_fill = 2;
  constexpr int scotch = 3;
  constexpr size_t small = 4000;
  constexpr int plain_graph = 1;
  constexpr int no_matching = 0;
  control(mumps, 6) = no_matching;
  control(mumps, 7) = size < small ? approximate_minimum_fill : scotch;
  control(mumps, 12) = plain_graph;
  // Pivots that are rounding errors (a body that can move freely) are counted instead of divided by.
  constexpr int detect_null_pivots = 24;
  constexpr double null_pivot_fraction = 1e-10;
  control(mumps, detect_null_pivots) = 1;
  mumps.cntl[3 - 1] = null_pivot_fraction;
  mumps.n = static_cast<int>(size);
  mumps.nnz = static_cast<MUMPS_INT8>(rows.size());
  mumps.irn = const_cast<int*>(rows.data());
  mumps.jcn = const_cast<int*>(columns.data());
}

SparseFactor::~SparseFactor() { instance_->run(terminate_instance); }

FactorResult SparseFactor::factorise(std::span<double> values) {
  DMUMPS_STRUC_C& mumps = instance_->mumps;
  constexpr int singular = -10;
  constexpr int work_space_too_small = -9;
  constexpr int work_space_percent = 14;
  mumps.a = values.data();
  if (!instance_->analysed) {
    instance_->check(instance_->run(analyse));
    instance_->analysed = true;
  }
  int status = instance_->run(factorise_values);
  while (status == work_space_too_small) {
    control(mumps, work_space_percent) *= 2;
    status = instance_->run(factorise_values);
  }
  if (status == singular) return {.singular = true, .negative_pivots = 0};
  instance_->check(status);
  constexpr int null_pivots = 28;
  if (outcome(mumps, null_pivots) > 0) return {.singular = true, .negative_pivots = 0};
  return {.singular = false, .negative_pivots = static_cast<size_t>(outcome(mumps, 12))};
}

size_t SparseFactor::entries() const {
  constexpr int factor_entries = 29;
  const int count = outcome(instance_->mumps, factor_entries);
  constexpr size_t million = 1'000'000;  // MUMPS counts beyond 2^31 in millions, with a minus sign
  return count >= 0 ? static_cast<size_t>(count) : static_cast<size_t>(-count) * million;
}

void SparseFactor::solve(std::span<double> right_sides, size_t count) {
  DMUMPS_STRUC_C& mumps = instance_->mumps;
  mumps.rhs = right_sides.data();
  mumps.nrhs = static_cast<int>(count);
  mumps.lrhs = mumps.n;
  instance_->check(instance_->run(back_substitute));
}

}  // namespace diastole
