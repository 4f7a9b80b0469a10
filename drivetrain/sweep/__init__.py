"""Many studies that differ in some of their entries, judged on all cores or a cluster, kept in shards."""
