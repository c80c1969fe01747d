"""Drives a mobile robot in an arc by messages on its velocity topic, and reads its odometry."""
import doppel

with doppel.Twin("kate") as twin:
    odometry = twin.subscribe("/base_controller/odom")
    for _ in range(30):  # 10 Hz for 3 s
        twin.publish("/base_controller/cmd_vel", {"twist": {"linear": {"x": 0.3}, "angular": {"z": 0.4}}})
        twin.run_for(0.1)
    position = odometry.latest["pose"]["pose"]["position"]
print(f"x = {position['x']:.3f} m, y = {position['y']:.3f} m")
