#pragma once
#include "core/solve/minimiser.h"
namespace lpdeform {
class Conic : public Minimiser { public: Conic(Problem p, Points x):p_(std::move(p)),x_(std::move(x)){} StepResult step() override {return {Outcome::kStalled,0,0};} const Points& x() const override {return x_;} Problem p_; Points x_; };
}
