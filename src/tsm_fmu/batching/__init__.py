"""Many pieces of the same work: here, in local processes, or on a Dask cluster; results are kept as they come."""
