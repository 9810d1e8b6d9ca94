#pragma once

#include <stdexcept>
#include <string>
#include <utility>
#include <variant>

namespace lpdeform::core {

/// Why a call was refused. Nothing has changed then.
struct Error {
  /// Stable, upper case, never reworded: "HANDLE_VERTEX_OUT_OF_RANGE". proto/errors.md lists them.
  std::string reason = {};
  /// The first offending element: "vertex 17", "face 3", "handle \"tip\"", "p[5]". May be empty.
  std::string element = {};
  /// The bound that was broken: "vertices < 370", "1 <= p <= 64". May be empty.
  std::string limit = {};
  /// One plain sentence for people, which names the value and the limit.
  std::string text = {};
};

/// What Result::value() throws where there is no value.
class Failure : public std::runtime_error {
 public:
  explicit Failure(Error error) : std::runtime_error(error.text), error_(std::move(error)) {}
  const Error& error() const { return error_; }

 private:
  Error error_;
};

/// A value, or the error in its place. The library itself throws nothing; value() does, in the caller's own code.
template <typename T>
class [[nodiscard]] Result {
 public:
  Result(T value) : state_(std::move(value)) {}
  Result(Error error) : state_(std::move(error)) {}

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }

  /// The value; throws Failure if there is none.
  T& value() & { return check(), *std::get_if<0>(&state_); }
  const T& value() const& { return check(), *std::get_if<0>(&state_); }
  T value() && { return check(), std::move(*std::get_if<0>(&state_)); }
  /// The value, which must be there.
  T& operator*() { return *std::get_if<0>(&state_); }
  const T& operator*() const { return *std::get_if<0>(&state_); }
  T* operator->() { return std::get_if<0>(&state_); }
  const T* operator->() const { return std::get_if<0>(&state_); }

  /// The error, which must be there.
  const Error& error() const { return *std::get_if<1>(&state_); }

 private:
  void check() const {
    if (!ok()) throw Failure(error());
  }
  std::variant<T, Error> state_;
};

/// Nothing, or an error.
template <>
class [[nodiscard]] Result<void> {
 public:
  Result() = default;
  Result(Error error) : state_(std::move(error)) {}

  bool ok() const { return state_.index() == 0; }
  explicit operator bool() const { return ok(); }
  /// Throws Failure if there is an error.
  void value() const {
    if (!ok()) throw Failure(error());
  }
  const Error& error() const { return *std::get_if<1>(&state_); }

 private:
  std::variant<std::monostate, Error> state_;
};

}  // namespace lpdeform::core
