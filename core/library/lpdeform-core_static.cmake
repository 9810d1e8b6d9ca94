# The component core_static of the package lpdeform: the static library, and the libraries that a program then links itself.
find_dependency(absl)
find_dependency(hwy)
find_dependency(TBB)
include(${CMAKE_CURRENT_LIST_DIR}/lpdeformCoreStaticTargets.cmake)
set(lpdeform_core_static_FOUND TRUE)
