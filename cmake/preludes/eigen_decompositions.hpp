// Eigen's decompositions of dense matrices, made once (eigen_decompositions.cpp) instead of in every source that uses one: a
// quarter of the time that those took to compile.
#pragma once
#include <Eigen/Dense>

#ifndef DIASTOLE_MADE_ELSEWHERE
#define DIASTOLE_MADE_ELSEWHERE extern
#endif

namespace Eigen {

DIASTOLE_MADE_ELSEWHERE template class ColPivHouseholderQR<MatrixXd>;
DIASTOLE_MADE_ELSEWHERE template class CompleteOrthogonalDecomposition<MatrixXd>;
DIASTOLE_MADE_ELSEWHERE template class HouseholderQR<MatrixXd>;
DIASTOLE_MADE_ELSEWHERE template class JacobiSVD<MatrixXd>;
DIASTOLE_MADE_ELSEWHERE template class LDLT<MatrixXd>;
DIASTOLE_MADE_ELSEWHERE template class LLT<MatrixXd>;
DIASTOLE_MADE_ELSEWHERE template class PartialPivLU<MatrixXd>;
DIASTOLE_MADE_ELSEWHERE template class SelfAdjointEigenSolver<Matrix3d>;
DIASTOLE_MADE_ELSEWHERE template class SelfAdjointEigenSolver<MatrixXd>;

// Members that are templates themselves.
DIASTOLE_MADE_ELSEWHERE template LDLT<MatrixXd>& LDLT<MatrixXd>::compute(const EigenBase<MatrixXd>&);
DIASTOLE_MADE_ELSEWHERE template LLT<MatrixXd>& LLT<MatrixXd>::compute(const EigenBase<MatrixXd>&);
DIASTOLE_MADE_ELSEWHERE template SelfAdjointEigenSolver<Matrix3d>& SelfAdjointEigenSolver<Matrix3d>::compute(
    const EigenBase<Matrix3d>&, int);
DIASTOLE_MADE_ELSEWHERE template SelfAdjointEigenSolver<MatrixXd>& SelfAdjointEigenSolver<MatrixXd>::compute(
    const EigenBase<MatrixXd>&, int);
DIASTOLE_MADE_ELSEWHERE template void LDLT<MatrixXd>::_solve_impl(const MatrixXd&, MatrixXd&) const;
DIASTOLE_MADE_ELSEWHERE template void LDLT<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
DIASTOLE_MADE_ELSEWHERE template void LLT<MatrixXd>::_solve_impl(const MatrixXd&, MatrixXd&) const;
DIASTOLE_MADE_ELSEWHERE template void LLT<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;
DIASTOLE_MADE_ELSEWHERE template void ColPivHouseholderQR<MatrixXd>::_solve_impl(const VectorXd&,
                                                                                 VectorXd&) const;
DIASTOLE_MADE_ELSEWHERE template void CompleteOrthogonalDecomposition<MatrixXd>::_solve_impl(const VectorXd&,
                                                                                             VectorXd&) const;
DIASTOLE_MADE_ELSEWHERE template void HouseholderQR<MatrixXd>::_solve_impl(const VectorXd&, VectorXd&) const;

}  // namespace Eigen

#undef DIASTOLE_MADE_ELSEWHERE
