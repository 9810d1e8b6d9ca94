// A small replacement of Unreal Engine 5, so that the sample can be compiled and run without it. It declares only what the
// sample uses, as Unreal does. Transforms have no scale.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <string>
#include <utility>
#include <vector>

using int32 = std::int32_t;
using uint32 = std::uint32_t;
using uint8 = std::uint8_t;
using TCHAR = char;

#define LPDEFORMUNREAL_API
#define TEXT(text) text
#define TCHAR_TO_UTF8(text) (text)
#define UTF8_TO_TCHAR(text) (text)
#define UCLASS(...)
#define USTRUCT(...)
#define UPROPERTY(...)
#define UFUNCTION(...)
#define UE_LOG(category, verbosity, ...) unreal_log(__VA_ARGS__)

inline std::vector<std::string> unreal_logs;
inline void unreal_log(const char* format, const char* text) {
  char line[1024];
  std::snprintf(line, sizeof line, format, text);
  unreal_logs.emplace_back(line);
}

class FString {
 public:
  FString(const TCHAR* text) : text_(text) {}
  const TCHAR* operator*() const { return text_.c_str(); }

 private:
  std::string text_;
};

class FName {
 public:
  FName() = default;
  FName(const TCHAR* text) : text_(text) {}
  FString ToString() const { return text_.c_str(); }

 private:
  std::string text_;
};

template <typename T>
class TArray {
 public:
  void Reset() { items_.clear(); }
  void SetNumZeroed(int32 count) { items_.assign(static_cast<std::size_t>(count), T{}); }
  int32 Add(T item) {
    items_.push_back(std::move(item));
    return Num() - 1;
  }
  int32 Num() const { return static_cast<int32>(items_.size()); }
  // With an index of any type, as in Unreal.
  template <typename Index>
  T& operator[](Index index) {
    return items_[static_cast<std::size_t>(index)];
  }
  template <typename Index>
  const T& operator[](Index index) const {
    return items_[static_cast<std::size_t>(index)];
  }
  auto begin() { return items_.begin(); }
  auto end() { return items_.end(); }

 private:
  std::vector<T> items_;
};

struct FVector {
  double X = 0, Y = 0, Z = 0;
  FVector() = default;
  FVector(double x, double y, double z) : X(x), Y(y), Z(z) {}
  FVector operator-(const FVector& b) const { return {X - b.X, Y - b.Y, Z - b.Z}; }
  FVector operator+(const FVector& b) const { return {X + b.X, Y + b.Y, Z + b.Z}; }
  FVector operator*(double by) const { return {X * by, Y * by, Z * by}; }
  bool operator==(const FVector& b) const = default;
  static FVector CrossProduct(const FVector& a, const FVector& b) {
    return {a.Y * b.Z - a.Z * b.Y, a.Z * b.X - a.X * b.Z, a.X * b.Y - a.Y * b.X};
  }
  static double Dist(const FVector& a, const FVector& b) {
    return std::hypot(a.X - b.X, a.Y - b.Y, a.Z - b.Z);
  }
};
using FVector3d = FVector;

struct FVector3f {
  FVector3f(float x, float y, float z) : X(x), Y(y), Z(z) {}
  float X, Y, Z;
};
struct FVector4f {
  FVector4f(float x, float y, float z, float w) : X(x), Y(y), Z(z), W(w) {}
  float X, Y, Z, W;
};

/// Of length 1. A * B turns by B first.
struct FQuat {
  double X = 0, Y = 0, Z = 0, W = 1;
  FQuat() = default;
  FQuat(double x, double y, double z, double w) : X(x), Y(y), Z(z), W(w) {}
  bool operator==(const FQuat& b) const = default;
  FQuat Inverse() const { return {-X, -Y, -Z, W}; }
  FQuat operator*(const FQuat& b) const {
    return {W * b.X + X * b.W + Y * b.Z - Z * b.Y, W * b.Y - X * b.Z + Y * b.W + Z * b.X,
            W * b.Z + X * b.Y - Y * b.X + Z * b.W, W * b.W - X * b.X - Y * b.Y - Z * b.Z};
  }
  FVector RotateVector(const FVector& v) const {
    const FVector axis(X, Y, Z);
    const FVector t = FVector::CrossProduct(axis, v) * 2;
    return v + t * W + FVector::CrossProduct(axis, t);
  }
};

class FTransform {
 public:
  FTransform() = default;
  FTransform(const FQuat& rotation, const FVector& location) : rotation_(rotation), location_(location) {}
  FVector GetLocation() const { return location_; }
  FQuat GetRotation() const { return rotation_; }
  FTransform GetRelativeTransform(const FTransform& other) const {
    const FQuat back = other.rotation_.Inverse();
    return {back * rotation_, back.RotateVector(location_ - other.location_)};
  }
  bool Equals(const FTransform& other, double) const {
    return rotation_ == other.rotation_ && location_ == other.location_;
  }

 private:
  FQuat rotation_;
  FVector location_;
};
