"""A local browser page: sliders for point, line and wheel; scenes to edit and run.

The content of a tab is a pure function of the texts in its fields (`point`, `line`, `wheel`,
`form`); those of line and wheel are options of commands (`tab`). `server` serves the page in
`page/`, `runs` starts the runs that it requests. `um_bridge` answers other programs; `serving` is
what both servers share. Imports all folders that simulate and draw, but no other command; starlette
and uvicorn only in `server`, `um_bridge` and `serving`.
"""
