// A picture without light from lights: what gather.wgsl has, empty.

fn gather(path: ptr<function, Path>, vertex: Vertex) {}

fn add_lights(path: ptr<function, Path>) {}
