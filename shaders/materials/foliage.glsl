// placeholder until surface.glsl is known
