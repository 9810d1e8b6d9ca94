#pragma once

#include <Eigen/Core>
#include <map>
#include <random>
#include <utility>
#include <vector>

#include "core/linalg/cholesky.h"

namespace lpdeform {

/// A dense positive definite matrix with a band of `width`, and its lower triangle.
inline Eigen::MatrixXd banded(int n, int width) {
  std::mt19937 random(5);
  std::uniform_real_distribution<double> value(-1, 1);
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    for (int j = std::max(0, i - width); j < i; ++j) a(i, j) = a(j, i) = value(random);
    a(i, i) = 2 * width + 1;
  }
  return a;
}

inline LowerMatrix lower(const Eigen::MatrixXd& a) {
  LowerMatrix result;
  result.columns.push_back(0);
  for (int column = 0; column < a.cols(); ++column) {
    for (int row = column; row < a.rows(); ++row) {
      if (row != column && a(row, column) == 0) continue;
      result.rows.push_back(row);
      result.values.push_back(a(row, column));
    }
    result.columns.push_back(static_cast<std::int32_t>(result.rows.size()));
  }
  return result;
}

/// The rows of a LowerMatrix. The matrix must outlive this.
class RowsOf : public SymmetricRows {
 public:
  explicit RowsOf(const LowerMatrix& matrix)
      : matrix_(matrix), above_(static_cast<std::size_t>(matrix.size())) {
    for (std::int32_t j = 0; j < matrix.size(); ++j) {
      for (std::int32_t k = matrix.columns[j] + 1; k < matrix.columns[j + 1]; ++k)
        above_[static_cast<std::size_t>(matrix.rows[k])].push_back({j, k});
    }
  }
  void append_row(std::int32_t i, std::vector<Entry>& to) const override {
    for (std::int32_t k = matrix_.columns[i]; k < matrix_.columns[i + 1]; ++k)
      to.push_back({matrix_.rows[k], matrix_.values[k]});
    for (const auto& [j, k] : above_[static_cast<std::size_t>(i)]) to.push_back({j, matrix_.values[k]});
  }

 private:
  const LowerMatrix& matrix_;
  std::vector<std::vector<std::pair<std::int32_t, std::int32_t>>> above_;  // column and entry, of each row
};

inline LowerMatrix with_shortcuts(const LowerMatrix& matrix, int count) {
  std::mt19937 random(9);
  std::uniform_int_distribution<int> point(0, matrix.size() - 1);
  std::vector<std::map<int, double>> columns(static_cast<std::size_t>(matrix.size()));
  for (std::int32_t c = 0; c < matrix.size(); ++c) {
    for (std::int32_t k = matrix.columns[c]; k < matrix.columns[c + 1]; ++k) {
      columns[static_cast<std::size_t>(c)][matrix.rows[k]] = matrix.values[k];
    }
  }
  for (int k = 0; k < count; ++k) {
    const int a = point(random), b = point(random);
    if (a == b || columns[static_cast<std::size_t>(std::min(a, b))].contains(std::max(a, b))) continue;
    columns[static_cast<std::size_t>(std::min(a, b))][std::max(a, b)] = -1;
    columns[static_cast<std::size_t>(a)][a] += 1;
    columns[static_cast<std::size_t>(b)][b] += 1;
  }
  LowerMatrix result;
  result.columns.push_back(0);
  for (const auto& column : columns) {
    for (const auto& [row, value] : column) result.rows.push_back(row), result.values.push_back(value);
    result.columns.push_back(static_cast<std::int32_t>(result.rows.size()));
  }
  return result;
}

/// The five-point Laplacian of a square, plus the identity: its tree has many branches. With `shortcuts`, that many pairs of
/// points are joined in addition, so that the tree is unbalanced and its top is large.
inline LowerMatrix square_laplacian(int side, int shortcuts = 0) {
  if (shortcuts > 0) return with_shortcuts(square_laplacian(side), shortcuts);
  LowerMatrix result;
  result.columns.push_back(0);
  const auto add = [&](int row, double value) { result.rows.push_back(row), result.values.push_back(value); };
  for (int i = 0; i < side * side; ++i) {
    add(i, 5);
    if ((i + 1) % side != 0) add(i + 1, -1);
    if (i + side < side * side) add(i + side, -1);
    result.columns.push_back(static_cast<std::int32_t>(result.rows.size()));
  }
  return result;
}

}  // namespace lpdeform
