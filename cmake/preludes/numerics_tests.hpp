// What tests of the estimator begin with.
#pragma once
#include "cmake/preludes/numerics.hpp"
#include "cmake/preludes/tests.hpp"
