# To be sourced: a ROS_DOMAIN_ID that no other test on this machine uses at the moment, on loopback only. The lock is
# released when the shell ends.
for ROS_DOMAIN_ID in {30..39}; do
  exec {domain_lock}> "${TMPDIR:-/tmp}/doppel-test-domain-$ROS_DOMAIN_ID" && flock -n "$domain_lock" && break
  exec {domain_lock}>&-
done
export ROS_DOMAIN_ID ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST
unset ROS_LOCALHOST_ONLY ROS_STATIC_PEERS
