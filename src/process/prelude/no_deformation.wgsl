
// The vertex in the object's shape of this frame: here, that of the mesh.
fn deform(in: VertexInput, object: Object) -> VertexInput {
    return in;
}
