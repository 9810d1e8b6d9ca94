# The component core of the package lpdeform: the shared library, which brings everything that it needs.
include(${CMAKE_CURRENT_LIST_DIR}/lpdeformCoreTargets.cmake)
set(lpdeform_core_FOUND TRUE)
