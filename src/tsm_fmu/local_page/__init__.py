"""A local page on which the verbs are used by mouse: `tsm_fmu.local_page.server` serves it, a job runs one verb."""
