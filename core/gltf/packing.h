#pragma once

#include <string>

#include "core/gltf/document.h"

namespace lpdeform::gltf {

/// One file that needs no other: the buffers, and images in files beside the glTF, are put into it. An image that lies
/// outside of the glTF's folder, or was not there when the glTF was read, stays named as it was. GLB has one buffer; several
/// become one. Throws a Refusal if the file would be too large, or if an image has gone since.
std::string packed_glb(Document document);

/// The same as JSON, with data URIs.
std::string packed_gltf(Document document);

}  // namespace lpdeform::gltf
