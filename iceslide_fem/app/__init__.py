"""A page in the browser of this machine: sliders for point, line and wheel, scenes edited and run.

What a tab shows is a pure function of the texts in its fields (`point`, `line`, `wheel`, `form`);
`server` brings it to the page in `page/`, `runs` starts what the page asks for. Imports all folders
that simulate and draw, but no other command; starlette and uvicorn only in `server` and `command`.
"""
