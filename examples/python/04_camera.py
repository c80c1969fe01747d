"""A picture of a robot's camera as a file."""
import doppel

with doppel.Twin("lab_arm") as twin:
    camera = twin.camera("camera")
    twin.run_for(0.1)
    picture = camera.rgb
with open("camera.ppm", "wb") as file:  # portable pixmap: every viewer of pictures reads it
    file.write(b"P6 %d %d 255\n" % (picture.shape[1], picture.shape[0]) + picture.tobytes())
print(f"camera.ppm: {picture.shape[1]} x {picture.shape[0]}, t = {camera.time:.3f} s")
