#include "core/solve/deformer.h"

int main() {
  return lpdeform::SolveSettings().tolerance > 0 ? 0 : 1;
}
