// What the estimator's files begin with.
#pragma once
#include "cmake/preludes/eigen_decompositions.hpp"
#include "cmake/preludes/text.hpp"
