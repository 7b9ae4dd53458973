"""Where everything is: polygons, fold states and mobility; numpy only."""
