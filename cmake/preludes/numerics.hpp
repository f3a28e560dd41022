// What the estimator's files begin with.
#pragma once
#include <Eigen/Dense>

#include "cmake/preludes/text.hpp"
