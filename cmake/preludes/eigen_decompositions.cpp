#define DIASTOLE_MADE_ELSEWHERE
#include "cmake/preludes/eigen_decompositions.hpp"
